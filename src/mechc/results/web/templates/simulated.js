// The motion that the page simulates: frames ahead of what is shown, and anew when a slider is moved.
const AHEAD = 10, LONGEST = 60;  // s of motion: simulated ahead, kept
const FIRST = 60, SLICE = 6;  // ms of simulation before the first picture of a motion, and between two
const mechanism = await create().catch(function (problem) {
  byId("failure").hidden = false;
  byId("failure").textContent = "The motion cannot begin: " + problem.message + ".";
  throw problem;
});
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const curves = motion.panels.flatMap(function (panel) { return panel.lines; });
let first = mechanism.y, wanted = {};  // where a start is sought from; values of it that were chosen
let frames = null, wishedFrames = 0, problemThere = "", scheduled = false;

function begin() {
  // At the start; throws where its loops cannot be closed.
  mechanism.start(wanted, { from: first });
  first = mechanism.y;
  frames = { start: 0, states: [], tracks: [], values: curves.map(function () { return []; }) };
  problemThere = "";
  wishedFrames = AHEAD / motion.step;
  addFrame();
}
function addFrame() {
  frames.states.push(mechanism.y);
  frames.tracks.push(mechanism.points());
  curves.forEach(function (curve, k) { frames.values[k].push(valueOf(curve)); });
}
function valueOf(curve) {
  const parts = curve.outputs.map(function (name) { return mechanism.output(name)[0]; });
  return curve.factor * (parts.length ? parts.reduce(function (a, b) { return a + b; }) : mechanism.get(curve.state));
}
function isComplete() { return problemThere !== "" || frames.states.length > wishedFrames; }
function simulate(patience) {
  const until = performance.now() + patience;
  try {
    while (!isComplete() && performance.now() < until) {
      mechanism.advance(frames.start + frames.states.length * motion.step);
      addFrame();
    }
  } catch (problem) { problemThere = "The motion ends here: " + problem.message; }
  if (!isComplete()) { schedule(); }
}
function schedule() {
  if (scheduled) { return; }
  scheduled = true;
  requestAnimationFrame(function () {
    scheduled = false;
    forget();
    simulate(SLICE);
    takeMotion(motionOfFrames());
  });
}
function motionOfFrames() {
  let next = 0;
  const points = new Float32Array(3 * motion.points.length * frames.tracks.length);
  frames.tracks.forEach(function (frame, i) { points.set(frame, i * frame.length); });
  const panels = motion.panels.map(function (panel) {
    return Object.assign({}, panel, {
      lines: panel.lines.map(function (line) { return Object.assign({}, line, { values: frames.values[next++] }); })
    });
  });
  return Object.assign({}, motion, axes(points), {
    start: frames.start, frames: frames.states.length, tracks: points, panels: panels,
    notes: [problemThere].concat(about.inputs.length ? "inputs have the values of their sliders, or 0" : []).filter(Boolean)
  });
}
function axes(points) {
  const size = points.reduce(function (most, x) { return Math.max(most, Math.abs(x)); }, 0);
  const flat = points.every(function (x, i) { return i % 3 < 2 || Math.abs(x) <= 1e-9 * size; });
  const names = about.drawing.view || (flat ? ["x", "y"] : ["x", "z"]);
  const [right, up] = names.map(function (name) {
    return AXES[name.slice(-1)].map(function (x) { return name[0] === "-" ? -x : x; });
  });
  return { flat: flat, right: right, up: up };
}
function showAnew(change) {
  // The motion after a change is shown at once; where there is none the last one stays.
  try { change(); }
  catch (problem) {
    byId("notes").textContent = problem.message + ": the last motion goes on";
    return;
  }
  simulate(FIRST);
  takeMotion(motionOfFrames());
}
function startAgain() {
  showAnew(function () { begin(); state.elapsed = 0; });
}
function goOnFrom(frame) {
  // With inputs as they are now.
  mechanism.start({}, { from: frames.states[frame], t: frames.start + frame * motion.step });
  [frames.states, frames.tracks].concat(frames.values).forEach(function (list) { list.length = frame + 1; });
  problemThere = "";
}
askForMore = function () {
  // The end is put off before it is reached, unless the motion begins again there.
  if (!state.looping && !problemThere && state.elapsed > span - 1) {
    wishedFrames = Math.ceil((state.elapsed + AHEAD) / motion.step);
    schedule();
  }
  return !isComplete();
};
function forget() {
  const count = Math.round(AHEAD / motion.step);
  if (frames.states.length <= LONGEST / motion.step) { return; }
  [frames.states, frames.tracks].concat(frames.values).forEach(function (list) { list.splice(0, count); });
  frames.start += AHEAD;
  wishedFrames -= count;
  state.elapsed -= AHEAD;
}

// -- sliders ----------------------------------------------------------------------------------
function isInput(slider) { return about.inputs.includes(slider.name); }
function isParameter(slider) { return slider.name in mechanism.parameters; }
function startValue(slider) {
  if (isInput(slider)) { return 0; }
  return isParameter(slider) ? mechanism.parameters[slider.name] : mechanism.get(slider.name);
}
function withRange(slider, value) {
  if (slider.low !== null) { return slider; }
  const half = slider.unit === "\u00b0" ? Math.PI / 2 : Math.max(1, Math.abs(value));
  const ends = isParameter(slider) && value !== 0 ? [0.3 * value, 2 * value] : [value - half, value + half];
  return Object.assign({}, slider, { low: Math.min(ends[0], ends[1]), high: Math.max(ends[0], ends[1]) });
}
function setValue(slider, value) {
  const named = { [slider.name]: value };
  if (isInput(slider)) { mechanism.give(named); }
  else if (isParameter(slider)) { mechanism.set(named); }
  else { wanted = Object.assign({}, wanted, named); }
}
function addSliders() {
  const moves = {};
  function showFollowing() {
    const values = mechanism.parameters;
    Object.keys(moves).forEach(function (name) { if (name in values) { moves[name](values[name]); } });
  }
  const resets = motion.sliders.map(function (given) {
    const value = startValue(given), slider = withRange(given, value);
    const follows = isParameter(slider) && !(slider.name in about.values);
    const move = moves[slider.name] = addSlider(byId("sliders"), slider, value, function (to) {
      setValue(slider, to);
      showFollowing();
      if (!isInput(slider)) { startAgain(); return; }
      showAnew(function () { goOnFrom(Math.ceil(fractionAt(state.elapsed))); });
    });
    return function () { setValue(slider, follows ? null : value); move(value); };
  });
  button(byId("sliders"), "Start again", "From the start, with inputs as they are now", startAgain);
  button(byId("sliders"), "Reset values", "All values as they were at first", function () {
    resets.forEach(function (reset) { reset(); });
    wanted = {};
    first = Float64Array.from(about.start);
    startAgain();
  });
}
addSliders();
begin();
simulate(FIRST);
takeData(motionOfFrames());
setLooping(false);
wordsAtEnd = "It goes on.";
