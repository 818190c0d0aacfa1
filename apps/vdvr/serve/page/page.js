// The page of `vdvr serve`. It holds the state that the server's answers bring, sends what the user did, and shows
// what comes back: coarse frames while something changes, the full one at rest. What events mean is the server's.
"use strict";

const $ = (id) => document.getElementById(id);
const picture = $("picture"), curve = $("curve"), status = $("status");
const client = Array.from(crypto.getRandomValues(new Uint8Array(8)), (b) => b.toString(16).padStart(2, "0")).join("");
// What tests read.
const stats = { moving: 0, still: 0, full: false, width: 0, height: 0, times: [], error: "" };
window.vdvr = stats;

let scene = null;        // scene.json
let state = null;        // as the last answer has it
let patch = {};          // members that the controls changed since the last request
let events = [];         // what happened on the picture since then
let asking = null;       // the AbortController of the request that is under way
let stillAsked = false;  // that one is for the still picture
let shownFull = false;
let lastInput = 0;
let stillBlob = null;
let picked = 0;          // point of the curve

// --- asking for frames ---

const shown = () => Object.assign({}, state, patch);
const unsent = () => events.length > 0 || Object.keys(patch).length > 0;

function change(members) {
  Object.assign(patch, members);
  touched();
}

function happened(event) {
  const last = events[events.length - 1];
  if (last && last.event_type === event.event_type) {
    if (event.event_type === "pointer_move") { events[events.length - 1] = event; return touched(); }
    if (event.event_type === "wheel") { last.dy += event.dy; return touched(); }
  }
  events.push(event);
  touched();
}

function touched() {
  lastInput = performance.now();
  shownFull = false;
  if (asking && stillAsked) asking.abort();
  pump();
}

function pump() {
  if (!state || asking) return;
  if (unsent()) return ask(true);
  if (shownFull) return;
  const rest = performance.now() - lastInput;
  if (rest >= 150) return ask(false);
  setTimeout(pump, 155 - rest);
}

async function ask(moving) {
  const sent = { state: shown(), events };
  const sentPatch = patch;
  patch = {};
  events = [];
  asking = new AbortController();
  stillAsked = !moving;
  let failed = "";
  try {
    const answer = await fetch(`frame/${client}/${moving ? "moving" : "still"}`, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(sent), signal: asking.signal,
      credentials: "omit", cache: "no-store",
    });
    if (answer.status === 409) return;
    if (!answer.ok) throw new Error((await answer.text()).trim());
    take(await answer.arrayBuffer(), moving, sentPatch);
  } catch (error) {
    if (error.name !== "AbortError") failed = error.message || "no answer";
    else patch = Object.assign(sentPatch, patch);
  } finally {
    asking = null;
    stats.error = failed;
    if (failed) {
      say(failed === "Failed to fetch" ? "the server does not answer" : failed, true);
      setTimeout(pump, 1000);
    } else {
      pump();
    }
  }
}

function take(buffer, moving, sentPatch) {
  const bytes = new Uint8Array(buffer);
  const end = bytes.indexOf(10);
  const line = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  state = line.state;
  const blob = new Blob([bytes.subarray(end + 1)], { type: line.type });
  if (!moving) {
    stillBlob = blob;
    tellCommand(line.command);
  }
  if (line.full && !moving) shownFull = true;
  showControls();
  show(blob, line, moving);
}

async function show(blob, line, moving) {
  const bitmap = await createImageBitmap(blob);
  if (picture.width !== state.width || picture.height !== state.height) {
    picture.width = state.width;
    picture.height = state.height;
  }
  const context = picture.getContext("2d");
  context.imageSmoothingEnabled = true;
  context.drawImage(bitmap, 0, 0, picture.width, picture.height);
  bitmap.close();
  stats.full = line.full && !moving;
  stats.width = line.width;
  stats.height = line.height;
  stats[moving ? "moving" : "still"] += 1;
  const now = performance.now();
  if (moving) stats.times.push(now);
  while (stats.times.length && now - stats.times[0] > 1000) stats.times.shift();
  const size = `${line.width} × ${line.height}`;
  say(moving ? `${size} · ${stats.times.length} frames/s` : `${size} · ${(1000 * line.seconds).toFixed(0)} ms`, false);
}

function say(text, bad) {
  status.textContent = text;
  status.classList.toggle("bad", bad);
}

// --- the picture: pointer, wheel, keys, size ---

const ratio = () => Math.min(window.devicePixelRatio || 1, 2);

function place(e) {
  const box = picture.getBoundingClientRect();
  return { x: (e.clientX - box.left) * state.width / box.width, y: (e.clientY - box.top) * state.height / box.height };
}

function modifiers(e) {
  return ["Shift", "Control", "Alt", "Meta"].filter((name) => e.getModifierState && e.getModifierState(name));
}

const fingers = new Map();
let pinch = null;

function centre() {
  const all = [...fingers.values()];
  const at = { x: 0, y: 0 };
  for (const p of all) { at.x += p.x / all.length; at.y += p.y / all.length; }
  at.spread = all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0;
  return at;
}

function press(at, button, e) {
  happened({ event_type: "pointer_down", x: at.x, y: at.y, button, modifiers: modifiers(e) });
}

picture.addEventListener("pointerdown", (e) => {
  if (!state) return;
  picture.setPointerCapture(e.pointerId);
  const at = place(e);
  if (e.pointerType !== "touch") return press(at, [1, 3, 2][e.button] || 0, e);
  fingers.set(e.pointerId, at);
  if (fingers.size === 1) return press(at, 1, e);
  // The second finger: the first drag ends, both move and zoom the picture.
  happened({ event_type: "pointer_up" });
  pinch = centre();
  press(pinch, 3, e);
});

picture.addEventListener("pointermove", (e) => {
  if (!state || (e.pointerType !== "touch" && e.buttons === 0)) return;
  const at = place(e);
  if (e.pointerType === "touch") {
    if (!fingers.has(e.pointerId)) return;
    fingers.set(e.pointerId, at);
  }
  const to = pinch ? centre() : at;
  happened({ event_type: "pointer_move", x: to.x, y: to.y });
  if (pinch && pinch.spread > 0 && to.spread > 0) {
    happened({ event_type: "wheel", dy: -800 * Math.log2(to.spread / pinch.spread) });
    pinch = to;
  }
});

function release(e) {
  fingers.delete(e.pointerId);
  if (fingers.size < 2) pinch = null;
  if (state) happened({ event_type: "pointer_up" });
}
picture.addEventListener("pointerup", release);
picture.addEventListener("pointercancel", release);
picture.addEventListener("contextmenu", (e) => e.preventDefault());
picture.addEventListener("dblclick", () => happened({ event_type: "double_click" }));
picture.addEventListener("wheel", (e) => {
  e.preventDefault();
  const unit = [1, 33, 400][e.deltaMode] || 1;
  if (state) happened({ event_type: "wheel", dy: e.deltaY * unit });
}, { passive: false });

const ownKeys = /^(Arrow(Left|Right|Up|Down)|Page(Up|Down)|Home|[-+=_xyz1-5rbl[\]])$/;
picture.addEventListener("keydown", (e) => {
  if (!state || e.ctrlKey || e.metaKey || e.altKey || !ownKeys.test(e.key)) return;
  e.preventDefault();
  happened({ event_type: "key_down", key: e.key, modifiers: modifiers(e) });
});

new ResizeObserver(() => {
  if (!state) return;
  fit();
}).observe($("stage"));

function fit() {
  const box = $("stage").getBoundingClientRect();
  const width = Math.max(16, Math.min(4096, Math.round(box.width * ratio())));
  const height = Math.max(16, Math.min(4096, Math.round(box.height * ratio())));
  if (width !== shown().width || height !== shown().height) change({ width, height });
}

// --- controls ---

const short = (x) => Number(x.toPrecision(4)).toString();

function slider(id, from, to) {
  const input = $(id);
  input.addEventListener("input", () => change(to(Number(input.value))));
  return () => {
    const [lo, hi, value] = from(shown());
    input.min = lo;
    input.max = hi;
    input.step = (hi - lo) / 500 || "any";
    if (document.activeElement !== input || !input.matches(":active")) input.value = value;
    $(`${id}-text`).textContent = short(value);
  };
}

function span(axis) {
  const g = scene.grid;
  return [g.origin[axis], g.origin[axis] + g.cells[axis] * g.spacing[axis]];
}
// Rounding of a slider's steps must not leave the volume.
const within = (x, [lo, hi]) => Math.min(hi, Math.max(lo, x));

// The box that is drawn; nothing while it holds the whole volume.
const wholeBox = () => [0, 1, 2].map((a) => span(a)[0]).concat([0, 1, 2].map((a) => span(a)[1]));
function cutTo(i, x) {
  const box = [...(shown().clip || wholeBox())];
  box[i] = within(x, span(i % 3));
  // Something is left between the two.
  const least = (span(i % 3)[1] - span(i % 3)[0]) / 500;
  if (i < 3) box[i] = Math.min(box[i], box[i + 3] - least);
  else box[i] = Math.max(box[i], box[i - 3] + least);
  return { clip: box.every((v, k) => v === wholeBox()[k]) ? null : box };
}
for (const [i, name] of [[0, "x from"], [3, "x to"], [1, "y from"], [4, "y to"], [2, "z from"], [5, "z to"]]) {
  const label = document.createElement("label");
  label.className = "slide";
  label.append(name + " ");
  label.append(Object.assign(document.createElement("output"), { id: `cut${i}-text` }));
  label.append(Object.assign(document.createElement("input"), { id: `cut${i}`, type: "range" }));
  $("cuts").append(label);
}
$("uncut").addEventListener("click", () => change({ clip: null }));

const sliders = [
  ...[0, 3, 1, 4, 2, 5].map((i) =>
    slider(`cut${i}`, (s) => [...span(i % 3), (s.clip || wholeBox())[i]], (x) => cutTo(i, x))),
  slider("iso", (s) => [...scene.bulk, s.iso], (iso) => ({ iso })),
  slider("position", (s) => [...span(s.slice_axis), s.slice_position],
    (x) => ({ slice_position: within(x, span(shown().slice_axis)) })),
  slider("black", (s) => [...scene.range, s.slice_range[0]],
    (x) => ({ slice_range: [Math.min(x, shown().slice_range[1]), shown().slice_range[1]] })),
  slider("white", (s) => [...scene.range, s.slice_range[1]],
    (x) => ({ slice_range: [shown().slice_range[0], Math.max(x, shown().slice_range[0])] })),
];

/// Buttons of which one is chosen, as radio buttons behave: arrows move, one tab stop.
function choice(group, chosen, choose) {
  const buttons = [...$(group).querySelectorAll("button")];
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => choose(button.dataset));
    button.addEventListener("keydown", (e) => {
      const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[e.key];
      if (!by) return;
      e.preventDefault();
      let next = i;
      do next = (next + by + buttons.length) % buttons.length; while (buttons[next].disabled);
      buttons[next].focus();
      choose(buttons[next].dataset);
    });
  });
  return () => {
    for (const button of buttons) {
      const on = chosen(button.dataset, shown());
      button.setAttribute("aria-checked", String(on));
      button.tabIndex = on ? 0 : -1;
    }
  };
}

const modes = choice("modes", (d, s) => d.mode === s.mode, (d) => change({ mode: d.mode }));
const axes = choice("axes", (d, s) => Number(d.axis) === s.slice_axis, (d) => {
  const axis = Number(d.axis);
  change({ slice_axis: axis, slice_position: within(scene.dense_center[axis], span(axis)) });
});

for (const name of ["shading", "bound"])
  $(name).addEventListener("change", () => change({ [name]: $(name).checked }));
$("reset").addEventListener("click", () => happened({ event_type: "double_click" }));

function showControls() {
  const s = shown();
  modes();
  axes();
  for (const refresh of sliders) refresh();
  $("shading").checked = s.shading;
  $("bound").checked = s.bound;
  $("legend").hidden = !s.bound;
  for (const element of document.querySelectorAll("[data-modes]"))
    element.hidden = !element.dataset.modes.split(" ").includes(s.mode);
  drawCurve();
}

// --- what can be taken along ---

function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
$("save").addEventListener("click", () => { if (stillBlob) save(stillBlob, "picture.png"); });
$("curve-save").addEventListener("click", () =>
  save(new Blob([JSON.stringify({ points: points() }, null, 2) + "\n"], { type: "application/json" }), "transfer.json"));

const quoted = (word) => /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;

function tellCommand(words) {
  const own = JSON.stringify(state.transfer) !== JSON.stringify(scene.first.transfer);
  const takesCurve = ["dvr", "mip"].includes(state.mode);
  const all = ["vdvr", "render", scene.file, "-o", "picture.png", ...words];
  if (own && takesCurve) all.push("--tf", "transfer.json");
  $("command").textContent = all.map(quoted).join(" ");
}
$("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText($("command").textContent);
    $("copy").textContent = "Copied";
  } catch {
    getSelection().selectAllChildren($("command"));
    $("copy").textContent = "Selected";
  }
  setTimeout(() => { $("copy").textContent = "Copy"; }, 1500);
});

// --- panel and theme ---

function open(on) {
  document.body.classList.toggle("closed", !on);
  $("panel-open").setAttribute("aria-expanded", String(on));
}
$("panel-open").addEventListener("click", () => open(document.body.classList.contains("closed")));
$("theme").addEventListener("click", () => {
  const dark = getComputedStyle(document.documentElement).colorScheme === "dark";
  document.documentElement.dataset.theme = dark ? "light" : "dark";
  drawCurve();
});

// --- start ---

async function start() {
  const answer = await fetch("scene.json", { credentials: "omit", cache: "no-store" });
  if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
  scene = await answer.json();
  document.title = `${scene.file} · vdvr`;
  $("file").textContent = scene.file;
  $("file").title = scene.file;
  $("version").textContent = `vdvr ${scene.version}`;
  for (const words of scene.words) $("words").appendChild(document.createElement("li")).textContent = words;
  $("bound").parentElement.classList.toggle("none", !scene.has_bounds);
  $("bound").disabled = !scene.has_bounds;
  document.querySelector('[data-mode="error"]').disabled = !scene.has_bounds;
  $("legend-end").textContent = `${short(scene.epsilon_abs)}, the tolerance`;
  state = scene.first;
  showControls();
  fit();
  // The first camera of a picture of this shape.
  happened({ event_type: "double_click" });
}

start().catch((error) => { stats.error = String(error); say(String(error.message || error), true); });
