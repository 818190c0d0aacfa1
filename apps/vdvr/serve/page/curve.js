// The transfer function as a curve of points, behind page.js in the same script.

const points = () => shown().transfer;

function curveSpan() {
  const p = points();
  const lo = Math.min(scene.bulk[0], p[0].value), hi = Math.max(scene.bulk[1], p[p.length - 1].value);
  const pad = 0.04 * (hi - lo || 1);
  return [lo - pad, hi + pad];
}

function curveBox() {
  const [lo, hi] = curveSpan();
  const w = curve.clientWidth, h = curve.clientHeight, edge = 8;
  return {
    w, h, edge,
    x: (value) => (value - lo) / (hi - lo) * w,
    y: (opacity) => h - edge - Math.sqrt(opacity) * (h - 2 * edge),
    value: (x) => lo + x / w * (hi - lo),
    opacity: (y) => within((h - edge - y) / (h - 2 * edge), [0, 1]) ** 2,
  };
}

const css = (rgb) => `rgb(${rgb.map((c) => Math.round(255 * c)).join(" ")})`;
const hex = (rgb) => "#" + rgb.map((c) => Math.round(255 * c).toString(16).padStart(2, "0")).join("");

function drawCurve() {
  if (curve.offsetParent === null) return;
  const b = curveBox(), p = points(), r = ratio();
  picked = Math.min(picked, p.length - 1);
  curve.width = b.w * r;
  curve.height = b.h * r;
  const c = curve.getContext("2d");
  c.scale(r, r);
  const style = getComputedStyle(document.documentElement);
  // How many samples have which density: the fourth root, so that small parts are seen.
  const most = Math.max(...scene.histogram);
  c.fillStyle = style.getPropertyValue("--line");
  scene.histogram.forEach((share, i) => {
    const at = (k) => b.x(scene.range[0] + k / scene.histogram.length * (scene.range[1] - scene.range[0]));
    const height = (share / most) ** 0.25 * (b.h - 4);
    c.fillRect(at(i), b.h - height, at(i + 1) - at(i) + 0.5, height);
  });
  const ribbon = c.createLinearGradient(0, 0, b.w, 0);
  for (const q of p) ribbon.addColorStop(within(b.x(q.value) / b.w, [0, 1]), css(q.rgb));
  c.beginPath();
  c.moveTo(0, b.h);
  c.lineTo(0, b.y(p[0].opacity));
  for (const q of p) c.lineTo(b.x(q.value), b.y(q.opacity));
  c.lineTo(b.w, b.y(p[p.length - 1].opacity));
  c.lineTo(b.w, b.h);
  c.globalAlpha = 0.75;
  c.fillStyle = ribbon;
  c.fill();
  c.globalAlpha = 1;
  c.strokeStyle = style.getPropertyValue("--ink");
  c.lineWidth = 1.5;
  c.stroke();
  p.forEach((q, i) => {
    c.beginPath();
    c.arc(b.x(q.value), b.y(q.opacity), i === picked ? 7 : 5, 0, 2 * Math.PI);
    c.fillStyle = css(q.rgb);
    c.fill();
    c.strokeStyle = style.getPropertyValue(i === picked ? "--accent" : "--ink");
    c.lineWidth = i === picked ? 3 : 1.5;
    c.stroke();
  });
  showPoint();
}

function showPoint() {
  const q = points()[picked];
  for (const [id, text] of [["point-value", short(q.value)], ["point-opacity", short(q.opacity)], ["point-colour", hex(q.rgb)]])
    if (document.activeElement !== $(id)) $(id).value = text;
  $("point-remove").disabled = points().length <= 2;
}

function setPoint(i, members) {
  const p = points().map((q) => ({ ...q }));
  Object.assign(p[i], members);
  const lo = i > 0 ? p[i - 1].value : -Infinity, hi = i + 1 < p.length ? p[i + 1].value : Infinity;
  p[i].value = within(p[i].value, [lo, hi]);
  change({ transfer: p });
  drawCurve();
}

function addPoint(value, opacity) {
  const p = points().map((q) => ({ ...q }));
  if (p.length >= 64) return;
  let i = p.findIndex((q) => q.value > value);
  if (i < 0) i = p.length;
  const a = p[Math.max(0, i - 1)], b = p[Math.min(i, p.length - 1)];
  const t = b.value > a.value ? within((value - a.value) / (b.value - a.value), [0, 1]) : 0;
  const rgb = a.rgb.map((c, k) => c + t * (b.rgb[k] - c));
  p.splice(i, 0, { value, rgb, opacity: opacity ?? a.opacity + t * (b.opacity - a.opacity) });
  picked = i;
  change({ transfer: p });
  drawCurve();
}

function removePoint() {
  if (points().length <= 2) return;
  const p = points().filter((_, i) => i !== picked);
  picked = Math.max(0, picked - 1);
  change({ transfer: p });
  drawCurve();
}

function curvePlace(e) {
  const box = curve.getBoundingClientRect();
  return [e.clientX - box.left, e.clientY - box.top];
}

let pulling = false;
curve.addEventListener("pointerdown", (e) => {
  if (!state) return;
  curve.setPointerCapture(e.pointerId);
  const [x, y] = curvePlace(e), b = curveBox();
  const far = points().map((q) => Math.hypot(b.x(q.value) - x, b.y(q.opacity) - y));
  const nearest = far.indexOf(Math.min(...far));
  if (far[nearest] <= 16) picked = nearest;
  else addPoint(b.value(x), b.opacity(y));
  pulling = true;
  drawCurve();
});
curve.addEventListener("pointermove", (e) => {
  if (!pulling) return;
  const [x, y] = curvePlace(e), b = curveBox();
  setPoint(picked, { value: b.value(x), opacity: b.opacity(y) });
});
for (const end of ["pointerup", "pointercancel"]) curve.addEventListener(end, () => { pulling = false; });
curve.addEventListener("keydown", (e) => {
  if (!state) return;
  const q = points()[picked], [lo, hi] = curveSpan(), step = (hi - lo) / 200;
  const height = Math.sqrt(q.opacity);
  const deeds = {
    PageUp: () => { picked = Math.min(points().length - 1, picked + 1); drawCurve(); },
    PageDown: () => { picked = Math.max(0, picked - 1); drawCurve(); },
    ArrowLeft: () => setPoint(picked, { value: q.value - step }),
    ArrowRight: () => setPoint(picked, { value: q.value + step }),
    ArrowUp: () => setPoint(picked, { opacity: within(height + 0.02, [0, 1]) ** 2 }),
    ArrowDown: () => setPoint(picked, { opacity: within(height - 0.02, [0, 1]) ** 2 }),
    Delete: removePoint,
    Insert: () => addPoint(q.value + 4 * step),
  };
  if (!deeds[e.key]) return;
  e.preventDefault();
  deeds[e.key]();
});

$("point-value").addEventListener("change", (e) => {
  if (e.target.value !== "" && Number.isFinite(e.target.valueAsNumber)) setPoint(picked, { value: e.target.valueAsNumber });
});
$("point-opacity").addEventListener("change", (e) => {
  if (e.target.value !== "" && Number.isFinite(e.target.valueAsNumber))
    setPoint(picked, { opacity: within(e.target.valueAsNumber, [0, 1]) });
});
$("point-colour").addEventListener("input", (e) => {
  setPoint(picked, { rgb: [1, 3, 5].map((i) => parseInt(e.target.value.slice(i, i + 2), 16) / 255) });
});
$("point-remove").addEventListener("click", removePoint);
$("curve-reset").addEventListener("click", () => { picked = 0; change({ transfer: scene.first.transfer }); drawCurve(); });
