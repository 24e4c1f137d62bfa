// The start.
byId("title").textContent = motion.title;
tellNotes();
addPlots();
addMarks();
readTheme();
startPicture();
setSpeed(state.speed);
new ResizeObserver(function () { resize(); show(); }).observe(canvas);
new ResizeObserver(drawPlots).observe(byId("plots"));
if (!openAtHash() && !stillSystem.matches) { setPlaying(true); }
