// The start.
found("title").textContent = motion.title;
tellNotes();
addPlots();
addMarks();
if (startStage()) {
  addMechanism();
  startCamera(canvas);
  addViews();
  addShows();
  canvas.setAttribute("aria-label", motion.title + ", " + motion.links.length
    + " links in space; arrow keys turn the view, plus and minus come nearer");
}
readTheme();
if (motion.export && renderer) {
  exportPictures(motion.export);
  throw new Error("The pictures are drawn.");  // nothing else of the page is needed
}
resize();
if (renderer) { seeView(homeView, 0, true); }
setSpeed(state.speed);
if (window.ResizeObserver) {
  new ResizeObserver(function () { resize(); show(); }).observe(stage);
  new ResizeObserver(drawPlots).observe(found("plots"));
}
if (motion.live) { listenToWidget(); }
if (!openAtHash() && !stillSystem.matches) { setPlaying(true); }
