const $ = (id) => document.getElementById(id);
const INK = "#1F2933", SOFT = "#5A6672", FAINT = "#D8DEE4", PAPER = "#fff", BLUE = "#0072B2";

// ---- canvases ------------------------------------------------------------------------------------------------------
function prepared(canvas, height) {
  const scale = window.devicePixelRatio || 1, width = canvas.clientWidth;
  canvas.style.height = height + "px";
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  return pen;
}
function copyOf(canvas) {
  const copy = document.createElement("canvas");
  copy.width = canvas.width;
  copy.height = canvas.height;
  copy.getContext("2d").drawImage(canvas, 0, 0);
  return copy;
}
function paste(pen, image) {
  pen.save();
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.drawImage(image, 0, 0);
  pen.restore();
}

// ---- floor: metres, y up -------------------------------------------------------------------------------------------
function outline(pen, rings, to) {
  pen.beginPath();
  for (const ring of rings) {
    ring.forEach(([x, y], k) => (k ? pen.lineTo(...to(x, y)) : pen.moveTo(...to(x, y))));
    pen.closePath();
  }
}
function placed(ring, x, y, heading) {
  const c = Math.cos(heading), s = Math.sin(heading);
  return ring.map(([a, b]) => [x + a * c - b * s, y + a * s + b * c]);
}
// Lay a course [m, y up] out on a canvas; return where it is drawn, and a copy of it to draw on anew.
function laidFloor(floor, course, picture) {
  const width = floor.clientWidth, scale = Math.min(width / course.width, Math.max(window.innerHeight * 0.72, 320) / course.height);
  const height = Math.ceil(course.height * scale), left = (width - course.width * scale) / 2;
  const pen = prepared(floor, height), [x0, y0] = course.origin || [0, 0];
  const to = (x, y) => [left + (x - x0) * scale, height - (y - y0) * scale];
  pen.clearRect(0, 0, width, height);
  pen.fillStyle = "#E9EDF1";
  pen.beginPath();
  pen.roundRect(left, 0, course.width * scale, height, 8);
  pen.fill();
  const fill = (rings, colour) => { outline(pen, rings, to); pen.fillStyle = colour; pen.fill("evenodd"); };
  for (const tile of course.tiles) fill([tile], PAPER);
  const [wide, tall] = course.field || [course.width, course.height];
  if (picture) pen.drawImage(picture, ...to(0, tall), wide * scale, tall * scale);
  pen.strokeStyle = "#EDF0F3";
  for (const tile of course.tiles) { outline(pen, [tile], to); pen.stroke(); }
  fill([course.start], "rgb(0 114 178 / .13)");
  fill([course.goal], "rgb(0 158 115 / .15)");
  fill(course.line, INK);
  pen.font = `${Math.max(10, 0.045 * scale)}px system-ui, "DejaVu Sans", sans-serif`;
  pen.textBaseline = "top";
  for (const [x, y, words] of course.labels) {
    const end = words === "START" || words === "GOAL";
    pen.fillStyle = words === "START" ? BLUE : words === "GOAL" ? "#007a58" : SOFT;
    pen.strokeStyle = PAPER;
    pen.lineWidth = 3;
    pen.font = pen.font.replace(/^(bold )?/, end ? "bold " : "");
    const [a, b] = to(x, y);
    pen.strokeText(words, a, b);
    pen.fillText(words, a, b);
  }
  for (const wall of course.walls) fill([wall], "#6B5B4B");
  return { pen, to, scale, width, height, still: copyOf(floor) };
}
