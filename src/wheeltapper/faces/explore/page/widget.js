// The explorer in the output of a notebook's cell. anywidget loads this; everything else comes over the widget's channel:
// the page, its modules and BokehJS. The page lives in a frame, so that neither its style nor its keys meet the notebook's.

const view = () => [...crypto.getRandomValues(new Uint32Array(4))].map((part) => part.toString(36)).join("");

// The files of the page by name, as texts.
function asked(model, name) {
  return new Promise((answered) => {
    const take = (message, buffers) => {
      if (message.view !== name || !message.files) return;
      model.off("msg:custom", take);
      answered(Object.fromEntries(message.files.map((file, i) => [file, new TextDecoder().decode(buffers[i])])));
    };
    model.on("msg:custom", take);
    model.send({ view: name, do: "files" });
  });
}

// The address of a module's text; what it imports has an address of its own, which replaces the name.
function addresses(files) {
  const found = new Map();
  const of = (name) => {
    if (!found.has(name)) {
      const whole = name.endsWith(".min.js") ? files[name]
        : files[name].replace(/ from "\.\/([\w-]+\.js)"/g, (_, other) => ` from "${of(other)}"`);
      found.set(name, URL.createObjectURL(new Blob([whole], { type: "text/javascript" })));
    }
    return found.get(name);
  };
  return { of, forget: () => { for (const address of found.values()) URL.revokeObjectURL(address); } };
}

// Light or dark, as the notebook is; null where it does not say.
function themeOf(body) {
  const { jpThemeLight, vscodeThemeKind } = body.dataset;
  if (jpThemeLight !== undefined) return jpThemeLight === "false" ? "dark" : "light";
  return vscodeThemeKind === undefined ? null : vscodeThemeKind.includes("light") ? "light" : "dark";
}

function render({ model, el }) {
  const name = view(), pipe = { kept: new Map(), theme: () => themeOf(document.body), received() {} };
  pipe.send = (message, buffers = []) => model.send({ ...message, view: name }, undefined, buffers);
  const receive = (message, buffers) => { if (message.view === name && !message.files) pipe.received(message, buffers ?? []); };
  model.on("msg:custom", receive);
  const frame = document.createElement("iframe");
  frame.title = "wheeltapper: explorer";
  frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 1px solid #8886; border-radius: 6px; resize: vertical`;
  const watch = new MutationObserver(() => frame.contentWindow?.carrier?.themed?.(pipe.theme()));
  watch.observe(document.body, { attributes: true, attributeFilter: ["data-jp-theme-light", "data-vscode-theme-kind"] });
  let scripts = null;
  asked(model, name).then((files) => {
    scripts = addresses(files);
    const page = new DOMParser().parseFromString(files["index.html"], "text/html");
    for (const held of page.querySelectorAll("script, link")) held.remove();
    page.head.append(Object.assign(page.createElement("style"), { textContent: files["style.css"] }));
    // A frame that the notebook moves is loaded again, as a page is.
    frame.addEventListener("load", async () => {
      const { contentWindow: inner, contentDocument: held } = frame;
      inner.pipe = pipe;
      for (const [file, type] of [["comm.js", "module"], ["bokeh.min.js", ""], ["bokeh-api.min.js", ""], ["main.js", "module"]]) {
        const script = Object.assign(held.createElement("script"), { type, src: scripts.of(file) });
        await new Promise((loaded) => { script.onload = loaded; script.onerror = loaded; held.body.append(script); });
      }
    });
    frame.srcdoc = `<!doctype html>${page.documentElement.outerHTML}`;
    el.append(frame);
  });
  return () => {
    watch.disconnect();
    model.off("msg:custom", receive);
    pipe.send({ do: "bye" });
    scripts?.forget();
  };
}

export default { render };
