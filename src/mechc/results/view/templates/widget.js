// Sliders above the page in space: values go to Python, motions come back and go to the page.
function part(tag, text, parent) {
  const made = document.createElement(tag);
  made.textContent = text;  // user text is only ever set as text
  parent.appendChild(made);
  return made;
}
function shown(slider, value) {
  return (value * slider.factor).toFixed(slider.digits).replace("-", "\u2212") + (slider.unit === "\u00b0" ? "" : "\u2009") + slider.unit;
}
function addSlider(model, slider, box, send) {
  const label = part("label", "", box), name = part("span", slider.label, label);
  const input = part("input", "", label), told = part("output", "", label);
  label.title = name.title = slider.title;
  Object.assign(input, { type: "range", min: slider.low, max: slider.high, step: "any" });
  function move() {
    input.value = model.get("values")[slider.name];
    tell();
  }
  function tell() {
    told.textContent = shown(slider, Number(input.value));
    input.setAttribute("aria-valuetext", told.textContent);
  }
  input.addEventListener("input", function () { tell(); send(slider.name, Number(input.value)); });
  move();
  return move;
}
function sender(model) {
  // At most once a picture; the notebook holds later values back until Python has answered.
  let waiting = {}, asked = false;
  return function (name, value) {
    waiting[name] = value;
    if (asked) { return; }
    asked = true;
    requestAnimationFrame(function () {
      model.set("values", Object.assign({}, model.get("values"), waiting));
      model.save_changes();
      waiting = {}; asked = false;
    });
  };
}
function addPage(model, box) {
  const frame = part("iframe", "", box);
  let loaded = false;
  frame.title = "The motion in space";
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");  // no access to the notebook
  frame.setAttribute("allow", "fullscreen");
  function pass() {
    const motion = model.get("motion");
    if (loaded && motion && motion.frames) { frame.contentWindow.postMessage({ motion: motion }, "*"); }
  }
  frame.addEventListener("load", function () { loaded = true; pass(); });
  frame.srcdoc = model.get("page");
  return pass;
}
function addReset(model, box, send) {
  const button = part("button", "Reset", box);
  button.type = "button";
  button.title = "All values as they were at first";
  button.addEventListener("click", function () {
    const first = model.get("first");
    Object.keys(first).forEach(function (name) { send(name, first[name]); });
  });
}
function render({ model, el }) {
  const box = part("div", "", el), sliders = part("div", "", box), send = sender(model);
  box.className = "mechc-motion";
  sliders.className = "mechc-sliders";
  const moves = model.get("sliders").map(function (slider) { return addSlider(model, slider, sliders, send); });
  addReset(model, sliders, send);
  const note = part("p", model.get("note"), box);
  note.setAttribute("role", "status");
  const heard = {
    "change:values": function () { moves.forEach(function (move) { move(); }); },
    "change:note": function () { note.textContent = model.get("note"); },
    "change:motion": addPage(model, box)
  };
  Object.keys(heard).forEach(function (name) { model.on(name, heard[name]); });
  return function () { Object.keys(heard).forEach(function (name) { model.off(name, heard[name]); }); };
}
export default { render };
