// ---- time: a page sets `times` [s], evenly spaced, and draws the sample `now` in `show` ----------------------------------
let times = [0], now = 0, playing = false, before = null;
const lastSample = () => times.length - 1;
const perSecond = () => lastSample() / Math.max(times[lastSample()], 1e-9);
function seek(k) {
  now = Math.min(Math.max(k, 0), lastSample());
  show();
}
function play(wanted) {
  playing = wanted;
  if (playing && now >= lastSample()) now = 0;
  before = null;
  $("play").textContent = playing ? "❚❚ Pause" : "▶ Play";
  $("play").setAttribute("aria-pressed", String(playing));
  show();
  if (playing) requestAnimationFrame(frame);
}
function frame(stamp) {
  if (!playing) return;
  const elapsed = before === null ? 0 : Math.min((stamp - before) / 1000, 0.1);
  before = stamp;
  now = Math.min(now + elapsed * perSecond() * Number($("pace").value), lastSample());
  if (now >= lastSample()) return play(false);
  show();
  requestAnimationFrame(frame);
}

$("play").addEventListener("click", () => play(!playing));
$("back").addEventListener("click", () => seek(0));
$("scrub").addEventListener("input", () => { play(false); seek(Number($("scrub").value)); });
const KEYS = {
  " ": () => play(!playing),
  ArrowLeft: (shift) => seek(Math.round(now) - (shift ? 1 : 0.1) * perSecond()),
  ArrowRight: (shift) => seek(Math.round(now) + (shift ? 1 : 0.1) * perSecond()),
  ",": () => seek(Math.round(now) - 1),
  ".": () => seek(Math.round(now) + 1),
  Home: () => seek(0),
  End: () => seek(lastSample()),
};
document.addEventListener("keydown", (event) => {
  const act = KEYS[event.key];
  if (!act || event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
  if (event.key === " " && event.target.tagName === "BUTTON" && event.target.id !== "play") return;
  event.preventDefault();
  if (event.key !== " ") play(false);
  act(event.shiftKey);
});
document.addEventListener("keyup", (event) => { if (event.key === " " && event.target.id === "play") event.preventDefault(); });
