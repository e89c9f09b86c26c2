// Files dropped on the page go to Python, which says what they are.

import { $, h } from "./dom.js";

export function listen(send, sceneChanged) {
  const words = $("#drop-words"), here = $("#drop-here");
  let inside = 0;
  document.addEventListener("dragenter", (event) => { event.preventDefault(); inside += 1; here.hidden = false; });
  document.addEventListener("dragleave", () => { inside -= 1; here.hidden = inside > 0; });
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    inside = 0;
    here.hidden = true;
    take([...event.dataTransfer.files]);
  });
  $("#choose").addEventListener("change", (event) => take([...event.target.files]));

  // Tables first: a recording is diagnosed with the site that came with it.
  async function take(files) {
    files.sort((a, b) => b.name.endsWith(".toml") - a.name.endsWith(".toml"));
    for (const file of files) {
      words.textContent = `${file.name} is read …`;
      $("#drop-part").open = true;
      try {
        show(await send(file));
      } catch (error) {
        words.textContent = `${file.name} could not be sent: ${error.message}`;
        return;
      }
    }
  }

  function show(told) {
    words.textContent = told.wrong ?? told.words;
    words.classList.toggle("wrong", Boolean(told.wrong));
    if (told.scene) { sceneChanged(); scrollTo(0, 0); }
    if (told.finding) {
      $("#finding").replaceChildren(h("pre", { textContent: told.finding }), h("img", { src: told.picture, alt: `finding: ${told.words}` }));
      $("#drop-part").scrollIntoView({ block: "nearest" });
    }
  }
}
