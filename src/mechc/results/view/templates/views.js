// Buttons and keys of the camera, and of what is shown.
function addViews() {
  const box = byId("views");
  [["front", "Front", "1"], ["top", "Top", "2"], ["side", "Side", "3"], ["isometric", "Isometric", "4"]].forEach(function (item) {
    keyed[item[2]] = function () { chooseView(item[0]); };
    button(box, item[1], item[1] + " (" + item[2] + ")", keyed[item[2]]);
  });
  keyed[0] = function () { fit(fractionAt(state.elapsed)); say("The view fits the motion."); };
  button(box, "Fit", "Fit (0)", keyed[0]);
  byId("keys").textContent += " \u00b7 1 2 3 4: views \u00b7 0: fit";
  addFollow(box);
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
function addShows() {
  if (trails.length) { keyed.r = toggle("Traces", "(r)", true, showTraces); }
  if (inferred.length) { keyed.b = toggle("Bodies", "(b): uniform bodies with the inertia that is known", true, showInferred); }
  if (motion.arrows.length) { keyed.v = toggle("Reactions", "(v): forces in the joints", forcesShown.has("arrows"), function (on) { showArrows("arrows", on); }); }
  if (motion.loads.length) { keyed.o = toggle("Loads", "(o): forces among the loads", forcesShown.has("loads"), function (on) { showArrows("loads", on); }); }
  if (grid) { keyed.g = toggle("Grid", "(g)", true, function (on) { if (grid) { grid.visible = on; } tellScale(); redraw(); }); }
}
const turning = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
onPicture = function (event) {
  // With the canvas focused arrows turn the view, + and - come nearer.
  if (document.activeElement !== canvas || !renderer) { return false; }
  if (turning[event.key]) { turnBy(turning[event.key][0], turning[event.key][1]); return true; }
  if (event.key === "+" || event.key === "-") { zoomBy(event.key === "+" ? 0.9 : 1 / 0.9); return true; }
  return false;
};
