"""The page of a set-up: one file of HTML with its geometry and a view by WebGL that can be turned.
It loads nothing from elsewhere."""
import html
import json

import numpy as np

from post.drives import coarse_tool
from post.scene import welded
from post.setup_picture import arrows
from post.style import SIDES
from post.view import EYE

DIGITS = 6       # of a coordinate

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>@TITLE@</title>
<style>
body { margin: 0; font: 14px sans-serif; display: flex; height: 100vh; }
#scene { position: relative; flex: 1; min-width: 0; }
#scene canvas { position: absolute; width: 100%; height: 100%; }
#names { pointer-events: none; }
#side { width: 26em; overflow: auto; padding: 0 1em 1em; border-left: 1px solid #ccc; }
#side p { margin: 0.2em 0 0.8em 1.7em; }
.key { display: inline-block; width: 1em; height: 1em; margin-right: 0.4em; }
#side p.finding { margin-left: 0; overflow-wrap: anywhere; }
.error { color: #a00000; }
.warning { color: #8a4b00; }
pre { white-space: pre-wrap; font-size: 12px; }
</style>
</head>
<body>
<div id="scene"><canvas id="faces"></canvas><canvas id="names"></canvas></div>
<div id="side">
<h3>@TITLE@</h3>
<p style="margin-left:0">@KEY@<br>Solid arrow: motion; dashed arrow: force; cross: first contact.
<br>Drag turns, with Shift shifts, the wheel zooms, a double click resets.</p>
@FINDINGS@
<div id="list"></div>
<h4>igaform --check</h4>
<pre>@REPORT@</pre>
</div>
<script>
"use strict";
const data = @DATA@;
@SCRIPT@
</script>
</body>
</html>
"""

SCRIPT = """
const faces = document.getElementById("faces"), names = document.getElementById("names");
const gl = faces.getContext("webgl", {antialias: true}), pen = names.getContext("2d");
const start = {turn: data.turn, tilt: data.tilt, zoom: 1, x: 0, y: 0};
let state = {...start};

function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function sum(a, s, b, t) { return a.map((value, i) => s * value + t * b[i]); }
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// Right, up and towards the eye, of a turn about the upright axis and a tilt.
function axesOf(state) {
  const [across, upright, front] = data.axes;
  const flat = sum(across, Math.sin(state.turn), front, Math.cos(state.turn));
  const toEye = sum(flat, Math.cos(state.tilt), upright, Math.sin(state.tilt));
  const right = sum(across, Math.cos(state.turn), front, -Math.sin(state.turn));
  return [right, cross(toEye, right), toEye];
}

// Place on the screen from -1 to 1 in its smaller direction, and depth.
function placeOf(point, axes) {
  const from = sum(point, 1, data.centre, -1), scale = state.zoom / data.radius;
  return [dot(from, axes[0]) * scale + state.x, dot(from, axes[1]) * scale + state.y,
          -dot(from, axes[2]) / (4 * data.radius)];
}

function shader(type, text) {
  const made = gl.createShader(type);
  gl.shaderSource(made, text);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw gl.getShaderInfoLog(made);
  return made;
}

const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, `
  attribute vec3 point, normal;
  uniform vec3 right, up, toEye, centre;
  uniform vec4 frame;        // scale, shift right and up, depth
  uniform vec2 aspect;
  varying float light;
  void main() {
    vec3 from = point - centre;
    vec2 place = frame.x * vec2(dot(from, right), dot(from, up)) + frame.yz;
    gl_Position = vec4(place * aspect, -dot(from, toEye) * frame.w, 1.0);
    light = dot(normal, normal) > 0.0 ? 0.5 + 0.5 * abs(dot(normal, toEye)) : 1.0;
  }`));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
  precision mediump float;
  uniform vec3 frontColour, backColour;
  varying float light;
  void main() {
    gl_FragColor = vec4((gl_FrontFacing ? frontColour : backColour) * light, 1.0);
  }`));
gl.linkProgram(program);
gl.useProgram(program);
const uniform = name => gl.getUniformLocation(program, name);

function buffer(values) {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
  return {made, count: values.length / 3};
}

function facesOf(part) {
  const points = [], normals = [];
  for (let i = 0; i < part.triangles.length; i += 3) {
    const ends = [0, 1, 2].map(k => part.points.slice(3 * part.triangles[i + k],
                                                      3 * part.triangles[i + k] + 3));
    const normal = cross(sum(ends[1], 1, ends[0], -1), sum(ends[2], 1, ends[0], -1));
    const length = Math.sqrt(dot(normal, normal)) || 1;
    for (const end of ends) {
      points.push(...end);
      normals.push(...normal.map(value => value / length));
    }
  }
  return {points: buffer(points), normals: buffer(normals)};
}

function linesOf(part) {
  const points = [];
  for (const i of part.edges) points.push(...part.points.slice(3 * i, 3 * i + 3));
  return {points: buffer(points), normals: buffer(points.map(() => 0))};
}

const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255);
for (const part of data.parts) Object.assign(part, {faces: facesOf(part), lines: linesOf(part)});

function drawBuffers(what, mode, front, back) {
  for (const [name, values] of [["point", what.points], ["normal", what.normals]]) {
    const place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, values.made);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
  }
  gl.uniform3fv(uniform("frontColour"), rgb(front));
  gl.uniform3fv(uniform("backColour"), rgb(back));
  gl.drawArrays(mode, 0, what.points.count);
}

function draw() {
  const ratio = window.devicePixelRatio || 1, box = faces.parentElement;
  for (const canvas of [faces, names]) {
    canvas.width = box.clientWidth * ratio;
    canvas.height = box.clientHeight * ratio;
  }
  const axes = axesOf(state), least = Math.min(faces.width, faces.height);
  gl.viewport(0, 0, faces.width, faces.height);
  gl.clearColor(1, 1, 1, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  ["right", "up", "toEye"].forEach((name, i) => gl.uniform3fv(uniform(name), axes[i]));
  gl.uniform3fv(uniform("centre"), data.centre);
  gl.uniform4f(uniform("frame"), state.zoom / data.radius, state.x, state.y, 0.25 / data.radius);
  gl.uniform2f(uniform("aspect"), least / faces.width, least / faces.height);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  for (const part of data.parts) {
    if (!part.isShown) continue;
    gl.polygonOffset(...(part === data.parts[0] ? [4, 16] : [1, 2]));   // a tool that touches wins
    drawBuffers(part.faces, gl.TRIANGLES, part.front, part.back);
    drawBuffers(part.lines, gl.LINES, part.colour, part.colour);
  }
  drawNames(axes, least, ratio);
}

function drawNames(axes, least, ratio) {
  const pixel = point => {
    const place = placeOf(point, axes);
    return [0.5 * (names.width + least * place[0]), 0.5 * (names.height - least * place[1])];
  };
  pen.clearRect(0, 0, names.width, names.height);
  pen.font = `${13 * ratio}px sans-serif`;
  pen.lineWidth = 2 * ratio;
  pen.textAlign = "center";
  for (const arrow of data.arrows)
    if (arrow.part === undefined || data.parts[arrow.part].isShown)
      drawArrow(pixel(arrow.tail), pixel(arrow.head), arrow, ratio);
  for (const cross of data.contacts) {
    if (!data.parts[cross.part].isShown) continue;
    const [x, y] = pixel(cross.place), d = 5 * ratio;
    line([[x - d, y - d], [x + d, y + d]], cross.colour);
    line([[x - d, y + d], [x + d, y - d]], cross.colour);
  }
  const corner = [45 * ratio, names.height - 45 * ratio], reach = 28 * ratio;
  "xyz".split("").forEach((name, i) => {
    const end = [corner[0] + reach * axes[0][i], corner[1] - reach * axes[1][i]];
    drawArrow(corner, end, {name: "", colour: "#000000"}, ratio);
    pen.fillText(name, corner[0] + 1.35 * reach * axes[0][i],
                 corner[1] - 1.35 * reach * axes[1][i] + 4 * ratio);
  });
}

function line(points, colour) {
  pen.strokeStyle = pen.fillStyle = colour;
  pen.beginPath();
  points.forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
  pen.stroke();
}

function drawArrow(tail, head, arrow, ratio) {
  const along = [head[0] - tail[0], head[1] - tail[1]], length = Math.hypot(...along) || 1;
  const [x, y] = along.map(value => 5 * ratio * value / length);
  pen.setLineDash(arrow.isForce ? [6 * ratio, 4 * ratio] : []);
  line([tail, head], arrow.colour);
  pen.setLineDash([]);
  pen.beginPath();
  pen.moveTo(...head);
  pen.lineTo(head[0] - 2 * x - y, head[1] - 2 * y + x);
  pen.lineTo(head[0] - 2 * x + y, head[1] - 2 * y - x);
  pen.fill();
  if (!arrow.name) return;
  pen.strokeStyle = "#ffffff";
  pen.lineWidth = 4 * ratio;
  pen.strokeText(arrow.name, tail[0], tail[1] - 4 * ratio);
  pen.lineWidth = 2 * ratio;
  pen.fillText(arrow.name, tail[0], tail[1] - 4 * ratio);
}

data.parts.forEach(part => {
  const box = document.createElement("input"), label = document.createElement("label");
  const words = document.createElement("p");
  box.type = "checkbox";
  box.checked = part.isShown = true;
  box.onchange = () => { part.isShown = box.checked; draw(); };
  label.append(box, " ", part.name);
  label.style.color = part.colour;
  label.style.fontWeight = "bold";
  words.innerText = part.words.join("\\n");
  document.getElementById("list").append(label, words);
});

let last = null;
faces.onpointerdown = event => { last = event; faces.setPointerCapture(event.pointerId); };
faces.onpointerup = () => { last = null; };
faces.onpointermove = event => {
  if (!last) return;
  const moved = [event.clientX - last.clientX, event.clientY - last.clientY];
  const least = 0.5 * Math.min(faces.clientWidth, faces.clientHeight);
  if (event.shiftKey) {
    state.x += moved[0] / least;
    state.y -= moved[1] / least;
  } else {
    state.turn -= 0.008 * moved[0];
    state.tilt = Math.max(-1.57, Math.min(1.57, state.tilt + 0.008 * moved[1]));
  }
  last = event;
  draw();
};
faces.addEventListener("wheel", event => {
  event.preventDefault();
  state.zoom *= Math.exp(-0.001 * event.deltaY);
  draw();
}, {passive: false});
faces.ondblclick = () => { state = {...start}; draw(); };
window.onresize = draw;
draw();
"""


def page(results, facts):
    """The text of the page."""
    title = html.escape(facts.heading or "Set-up")
    key = "<br>".join(f'<span class="key" style="background:{SIDES[name]}"></span>{text}'
                      for name, text in (("blank", "blank"),
                                         ("sheet side", "side of a tool on which the blank lies"),
                                         ("back", "back of a tool")))
    findings = "\n".join(f'<p class="finding {kind}">{html.escape(words)}</p>'
                         for kind, words in facts.findings)
    data = json.dumps(data_of(results, facts)).replace("</", "<\\/")
    text = PAGE
    for name, value in (("TITLE", title), ("KEY", key), ("SCRIPT", SCRIPT), ("DATA", data),
                        ("FINDINGS", findings), ("REPORT", html.escape(facts.report))):
        text = text.replace(f"@{name}@", value)
    return text


def data_of(results, facts):
    """Geometry and texts for the script."""
    parts = [part_data(facts.sheet, "blank", "#305080", facts.blank, SIDES["blank"],
                       SIDES["blank"])]
    for fact in facts.tools:
        part = coarse_tool(results, fact.name)
        part.triangles = part.triangles[:, ::results.side(fact.name)]
        parts.append(part_data(part, fact.name, fact.colour, fact.words, SIDES["sheet side"],
                               SIDES["back"]))
    points = np.concatenate([np.reshape(part["points"], (-1, 3)) for part in parts])
    low, high = points.min(axis=0), points.max(axis=0)
    number = {fact.name: i + 1 for i, fact in enumerate(facts.tools)}
    upright = np.eye(3)[facts.view.up_axis]
    across = np.eye(3)[1 if facts.view.up_axis == 0 else 0]
    return {"parts": parts, "centre": (0.5 * (low + high)).tolist(),
            "radius": 0.55 * float(np.linalg.norm(high - low)),
            "axes": [across.tolist(), upright.tolist(), np.cross(across, upright).tolist()],
            "turn": float(np.arctan2(EYE[0], EYE[2])),
            "tilt": float(np.arcsin(EYE[1] / np.linalg.norm(EYE))),
            "arrows": [{"name": fact.name, "part": number[fact.name], "colour": fact.colour,
                        "isForce": fact.drive.kind == "FORCE", "tail": tail.tolist(),
                        "head": head.tolist()} for fact, tail, head in arrows(facts)],
            "contacts": [{"part": number[fact.name], "colour": fact.colour,
                          "place": np.asarray(fact.place).tolist()}
                         for fact in facts.tools if fact.has_gap]}


def part_data(part, name, colour, words, front, back):
    part = welded(part)
    edges = np.sort(part.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    return {"name": name, "colour": colour, "words": words, "front": front, "back": back,
            "points": [float(f"{value:.{DIGITS}g}") for value in part.points.ravel()],
            "triangles": part.triangles.ravel().tolist(),
            "edges": edges[counts == 1].ravel().tolist()}
