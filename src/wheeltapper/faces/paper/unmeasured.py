"""Statements of the paper that nothing here measures, each with the reason."""

from wheeltapper.faces.paper.claims import statement

for number, section, sentence, why_not in (
    (
        "C58", 5, "the height of bounces at the resonance depends on the wheelset's mass and on the load",
        "chaos hides it: quartiles of ten runs, 2.5 to 5.3 mm at 1500 kg, overlap with those at 1200 and 1800 kg and "
        "with those at a load 20 % lower",
    ),
    (
        "C59", 6, "the deck's bearings should be prestressed with the static force of the wheelset that comes",
        "a rule of design: every deck here is prestressed so",
    ),
    (
        "C60", 1, "badly fixed ends of springs and dampers are faults of interest",
        "an aim, without a statement of what they show; ends with play and soft bushes are in the catalogue of faults",
    ),
    (
        "C61", 6, "short irregularities do not affect the ride of the bogie much, but noise and forces profoundly",
        "no bound is told for the bogie, and nothing here computes noise; C25 measures the car body, C29 forces",
    ),
    (
        "C62", 6, "at forces above twice the static load the limits of elastic behaviour are exceeded",
        "it depends on the steel: yield strengths of 500 and 785 MPa give 0.5 and 2 static loads; C44 takes 2 as given",
    ),
    (
        "C63", 6, "fatigue: a long series of impacts and high forces beyond the resonance make cracks",
        "nothing here computes damage by fatigue",
    ),
    (
        "C64", 6, "normal forces on a stiff track are sensitive to different defects of wheelsets and suspensions",
        "no defect but the broken spring of C41 is told by what it shows",
    ),
    (
        "C65", 6, "all modern trains run beyond the resonance in normal motion",
        "a statement about operation; it follows from the speeds of C40",
    ),
):  # fmt: skip
    statement(number, section, sentence, why_not)
