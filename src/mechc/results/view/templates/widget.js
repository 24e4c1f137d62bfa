// Sliders above the page in space: values go to Python, motions come back and go to the page.
function sender(model) {
  // At most once a picture; the notebook holds later values back until Python has answered.  Values
  // that follow others are not sent: those here may be older than Python's.
  let moved = {}, asked = false;
  return function (values) {
    Object.assign(moved, values);
    if (asked) { return; }
    asked = true;
    requestAnimationFrame(function () {
      model.set("values", Object.assign({}, moved));
      model.save_changes();
      asked = false;
    });
  };
}
function addPage(model, box) {
  const frame = element("iframe", "", box);
  let loaded = false;
  frame.title = "The motion in space";
  frame.setAttribute("sandbox", "allow-scripts");  // no access to the notebook
  frame.setAttribute("allow", "fullscreen");
  function pass() {
    const motion = model.get("motion");
    if (loaded && motion && motion.frames) { frame.contentWindow.postMessage({ motion: motion }, "*"); }
  }
  frame.addEventListener("load", function () { loaded = true; pass(); });
  frame.srcdoc = model.get("page");
  return pass;
}
function render({ model, el }) {
  const box = element("div", "", el), sliders = element("div", "", box), send = sender(model);
  box.className = "mechc-motion";
  sliders.className = "mechc-sliders";
  const moves = model.get("sliders").map(function (slider) {
    const move = addSlider(sliders, slider, model.get("values")[slider.name], function (value) { send({ [slider.name]: value }); });
    return function () {
      const values = model.get("values");
      if (slider.name in values) { move(values[slider.name]); }
    };
  });
  button(sliders, "Reset", "All values as they were at first", function () {
    send(model.get("first"));
  });
  const note = element("p", model.get("note"), box);
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
