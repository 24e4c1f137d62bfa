// Buttons of the camera, what is shown, keys.
function addViews() {
  const box = found("views");
  [["front", "Front", "1"], ["top", "Top", "2"], ["side", "Side", "3"], ["isometric", "Isometric", "4"]].forEach(function (item) {
    button(box, item[1], "(" + item[2] + ")", function () { chooseView(item[0]); });
  });
  button(box, "Fit", "(0)", function () { fit(fractionAt(state.elapsed)); say("The view fits the motion."); });
  addFollow(box);
}
function button(box, text, key, use) {
  const made = element("button", text, box);
  made.type = "button";
  made.title = text + " " + key;
  made.addEventListener("click", use);
  return made;
}
function chooseView(name) {
  seeView(name, fractionAt(state.elapsed));
  say("Seen from: " + name + ".");
}
function addFollow(box) {
  const choice = element("select", "", box);
  choice.id = "follow";
  choice.setAttribute("aria-label", "The camera follows");
  choice.title = "What the camera follows";
  [["-1", "Camera stays"], ["0", "Follow all"]].concat(motion.links.map(function (link, i) {
    return [String(i + 1), "Follow " + link.label];
  })).forEach(function (item) { element("option", item[1], choice).value = item[0]; });
  choice.value = String(followed);
  choice.addEventListener("change", function () {
    follow(Number(choice.value), fractionAt(state.elapsed));
    say(choice.selectedOptions[0].textContent + ".");
    redraw();
  });
}
const reapplied = [];  // to bodies that are made anew
function toggle(text, key, on, use) {
  const made = button(found("shows"), text, key, function () { flip(); });
  function flip() {
    on = !on;
    made.setAttribute("aria-pressed", String(on));
    use(on);
    say(text + (on ? " shown." : " hidden."));
  }
  made.setAttribute("aria-pressed", String(on));
  reapplied.push(function () { use(on); });
  return flip;
}
const keyed = {};
function addShows() {
  if (trails.length) { keyed.r = toggle("Traces", "(r)", true, showTraces); }
  if (inferred.length) { keyed.b = toggle("Bodies", "(b): uniform bodies with the inertia that is known", true, showInferred); }
  if (motion.arrows.length) { keyed.v = toggle("Reactions", "(v): forces in the joints", true, function (on) { showArrows("reaction", on); }); }
  if (motion.loads.length) { keyed.o = toggle("Loads", "(o): forces among the loads", false, function (on) { showArrows("load", on); }); }
  if (grid) { keyed.g = toggle("Grid", "(g)", true, function (on) { if (grid) { grid.visible = on; } found("scale").hidden = !on; redraw(); }); }
}
function fullScreen() {
  if (document.fullscreenElement) { document.exitFullscreen(); return; }
  const asked = document.documentElement.requestFullscreen && document.documentElement.requestFullscreen();
  if (asked && asked.catch) { asked.catch(function () { say("Full screen is not allowed here."); }); }
}
Object.assign(keyed, {
  " ": function () { setPlaying(!state.playing); },
  Home: function () { goTo(0); },
  End: function () { goTo(span); },
  1: function () { chooseView("front"); }, 2: function () { chooseView("top"); },
  3: function () { chooseView("side"); }, 4: function () { chooseView("isometric"); },
  0: function () { fit(fractionAt(state.elapsed)); },
  "+": function () { nextSpeed(1); }, "-": function () { nextSpeed(-1); },
  l: setLoop, t: switchTheme, f: fullScreen,
  p: function () { if (charts.length) { showPlots(found("plots").hidden); } }
});
const turning = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
function onCanvas(event) {
  // With the canvas focused arrows turn the view, + and - come nearer.
  if (document.activeElement !== canvas) { return false; }
  if (turning[event.key]) { turnBy(turning[event.key][0], turning[event.key][1]); return true; }
  if (event.key === "+" || event.key === "-") { zoomBy(event.key === "+" ? 0.9 : 1 / 0.9); return true; }
  return false;
}
document.addEventListener("keydown", function (event) {
  const focus = document.activeElement ? document.activeElement.tagName : "";
  if (event.ctrlKey || event.metaKey || event.altKey || focus === "SELECT") { return; }
  if (event.key === " " && focus === "BUTTON") { return; }  // a focused button keeps its own meaning
  if (onCanvas(event)) { event.preventDefault(); return; }
  if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
    const way = event.key === "ArrowRight" ? 1 : -1;
    if (event.shiftKey) { leap(way / 20); } else { step(way); }
  } else if (keyed[event.key]) { keyed[event.key](); } else { return; }
  event.preventDefault();
});
found("theme").addEventListener("click", switchTheme);
found("whole").addEventListener("click", fullScreen);
found("plots-button").addEventListener("click", function () { showPlots(found("plots").hidden); });
