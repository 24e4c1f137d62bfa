// Elements of a page and of the widget in a notebook.
function element(tag, text, parent) {
  const made = document.createElement(tag);
  made.textContent = text;  // user text is only ever set as text
  parent.appendChild(made);
  return made;
}
function button(parent, text, title, use) {
  const made = element("button", text, parent);
  made.type = "button";
  made.title = title;
  made.addEventListener("click", use);
  return made;
}
function number(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? "\u2212" + text : text;
}
function addSlider(parent, slider, value, use) {
  // Shown in its unit; returns a function that moves it.
  const label = element("label", "", parent), name = element("span", slider.label, label);
  const input = element("input", "", label), output = element("output", "", label);
  const digits = Math.max(0, Math.min(9, 2 - Math.round(Math.log10(slider.factor * (slider.high - slider.low)))));
  label.title = name.title = slider.title;
  Object.assign(input, { type: "range", min: slider.low, max: slider.high, step: "any" });
  function showValue() {
    const gap = slider.unit === "\u00b0" ? "" : "\u2009";
    output.textContent = number(slider.factor * Number(input.value), digits) + gap + slider.unit;
    input.setAttribute("aria-valuetext", output.textContent);
  }
  function move(to) { input.value = to; showValue(); }
  input.addEventListener("input", function () { showValue(); use(Number(input.value)); });
  move(value);
  return move;
}
