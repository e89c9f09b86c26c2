"""What a sweep refuses, and how it says so."""

import pytest

import wheeltapper as wt

SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307),
    contact=wt.Hertz(constant=1.4e11),
    irregularity=wt.Step(height=1e-4, position=0.01),
    speed=5,
    duration=0.1,
)
INTERVAL = wt.features.impact_interval()
REFUSED = [
    ({"vehicle.wheels": [1, 2]}, {}, "vehicle.wheels", "no continuous number"),
    ({"rolling": ["point"]}, {}, "rolling", "no continuous number"),
    ({"irregularity.0.ideal": [0, 1]}, {}, "irregularity.0.ideal", "no continuous number"),
    ({"contact.hysteresis": [0.1]}, {}, "contact.hysteresis", "nothing set"),
    ({"vehicle.mas": [1.0]}, {}, "vehicle.mas", "no such field"),
    ({"irregularity.1.height": [1.0]}, {}, "irregularity.1.height", "no such field"),
    ({"vehicle.mass": [1500, -1]}, {}, "vehicle.mass", "-1"),
    ({"vehicle.mass": ["5 m"]}, {}, "vehicle.mass", "5 m"),
    ({"vehicle.mass": []}, {}, "vehicle.mass", "no values"),
    ({"vehicle.mass": [float("nan")]}, {}, "vehicle.mass", "not finite"),
    ({}, {}, "over", "nothing"),
    ({"vehicle.mass": [1.0, 2.0], "speed": [1.0]}, {"zipped": True}, "over", "different lengths"),
    ({"vehicle.mass": [1.0, 2.0, 3.0]}, {"samples": 4}, "vehicle.mass", "3 values"),
    ({"vehicle.mass": [1.0, 2.0]}, {"samples": 4, "sampling": "dice"}, "sampling", "dice"),
    ({"vehicle.mass": [1.0, 2.0]}, {"method": "rough"}, "method", "rough"),
]


@pytest.mark.parametrize(("over", "more", "field", "found"), REFUSED)
def test_a_wrong_study_is_refused_before_anything_is_computed(over, more, field, found):
    with pytest.raises(wt.InputError) as error:
        wt.sweep(SCENE, over, [INTERVAL], **more)
    assert field in str(error.value)
    assert found in str(error.value)


def test_features_are_checked():
    for features in ([], [INTERVAL, wt.features.impact_interval(2, 3)]):
        with pytest.raises(wt.InputError, match="features"):
            wt.sweep(SCENE, {"speed": [5.0]}, features)
    both = [INTERVAL, wt.features.impact_interval(2, 3).renamed("second_interval")]
    assert set(wt.sweep(SCENE, {"speed": [5.0]}, both)) == {"impact_interval", "second_interval", "status"}
    with pytest.raises(wt.InputError, match="counted from 1"):
        wt.features.impact_interval(2, 2)
    with pytest.raises(wt.InputError, match="onsets"):
        wt.features.impact_interval(between="ends")
