// Pictures for a file: each asked time is drawn, and the page is then nothing but their texts.
function exportPictures(order) {
  const sheet = document.createElement("canvas"), brush = sheet.getContext("2d");
  sheet.width = order.width; sheet.height = order.height;
  renderer.setPixelRatio(1);
  renderer.setSize(order.width, order.height, false);
  camera.aspect = order.width / order.height;
  camera.updateProjectionMatrix();
  seeView(order.camera || homeView, 0, true);
  const pictures = order.times.map(function (time) {
    state.elapsed = time;
    const at = fractionAt(time);
    moveBodies(at);
    followTo(at);
    moveTrails(at, order.speed);
    render();
    drawSheet(brush, order, time);
    return sheet.toDataURL("image/png").split(",")[1];
  });
  document.body.textContent = "";
  element("pre", pictures.join(" "), document.body).id = "pictures";
}
function drawSheet(brush, order, time) {
  brush.fillStyle = look.sky;
  brush.fillRect(0, 0, order.width, order.height);
  brush.drawImage(canvas, 0, 0);
  brush.fillStyle = look.ink;
  brush.font = "600 16px system-ui, sans-serif";
  brush.fillText(motion.title, 14, 26);
  brush.fillStyle = look.quiet;
  brush.font = "14px system-ui, sans-serif";
  brush.fillText(timeText(time), 14, order.height - 14);
  const scale = byId("scale").textContent;
  brush.fillText(scale, order.width - 14 - brush.measureText(scale).width, order.height - 14);
}
