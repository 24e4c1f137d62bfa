// Keys, buttons of the page, what is shown.
const keyed = {
  " ": function () { setPlaying(!state.playing); },
  Home: function () { goTo(0); },
  End: function () { goTo(span); },
  "+": function () { nextSpeed(1); }, "-": function () { nextSpeed(-1); },
  l: switchLoop, t: switchTheme, f: fullScreen, p: switchPlots
};
let onPicture = function () { return false; };  // keys that turn the picture while it is focused

const reapplied = [];  // to a picture that is made anew
function toggle(text, title, on, use) {
  const made = button(byId("shows"), text, text + " " + title, flip);
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
function fullScreen() {
  if (document.fullscreenElement) { document.exitFullscreen(); return; }
  const asked = document.documentElement.requestFullscreen && document.documentElement.requestFullscreen();
  if (asked && asked.catch) { asked.catch(function () { say("Full screen is not allowed here."); }); }
}
document.addEventListener("keydown", function (event) {
  const focus = document.activeElement ? document.activeElement.tagName : "";
  if (event.ctrlKey || event.metaKey || event.altKey || focus === "SELECT") { return; }
  if (event.key === " " && focus === "BUTTON") { return; }  // a focused button keeps its own meaning
  if (focus === "INPUT" && document.activeElement !== scrub && /^(Arrow|Home|End)/.test(event.key)) { return; }
  if (onPicture(event)) { event.preventDefault(); return; }
  if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
    const way = event.key === "ArrowRight" ? 1 : -1;
    if (event.shiftKey) { goTo(state.elapsed + way * span / 20); } else { step(way); }
  } else if (keyed[event.key]) { keyed[event.key](); } else { return; }
  event.preventDefault();
});
byId("theme").addEventListener("click", switchTheme);
byId("whole").addEventListener("click", fullScreen);
byId("plots-button").addEventListener("click", switchPlots);
