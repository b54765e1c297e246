// SPDX-License-Identifier: Apache-2.0
#include "report/volume_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr const char* kTurnStyle = R"(<style>
.turn { max-width: 46rem; } .turn canvas { display: block; width: 100%; aspect-ratio: 1; max-height: 75vh;
  background: #000; touch-action: pan-y; cursor: grab; border-radius: .3rem; }
.turn canvas:focus-visible { outline: 3px solid #0072b2; outline-offset: 2px; }
.turn .knobs { display: grid; grid-template-columns: repeat(auto-fit, minmax(10rem, 1fr)); gap: .3rem 1rem; }
.turn label { display: block; font-size: .9rem; } .turn input { width: 100%; min-height: 2.75rem; }
</style>
)";

// The shaders: a ray from the eye through each pixel, in metres from the middle of the points. Values are
// looked up trilinearly; light falls by what lies before it.
constexpr const char* kShaders = R"(
const vertex = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1), 0, 1); }`;
const fragment = `#version 300 es
precision highp float; precision highp sampler3D;
uniform sampler3D points; uniform vec3 size, eye, right, upwards, forward;
uniform vec2 whole; uniform float pixels, zoom, stride, brightest, densest, gain;
out vec4 colour;
void main() {
  vec2 at = (2. * gl_FragCoord.xy - whole) / pixels / zoom;
  vec3 way = normalize(forward + at.x * right + at.y * upwards);
  way += vec3(equal(way, vec3(0))) * 1e-9;
  vec3 a = (-.5 * size - eye) / way, b = (.5 * size - eye) / way, low = min(a, b), high = max(a, b);
  float from = max(0., max(low.x, max(low.y, low.z))), to = min(high.x, min(high.y, high.z));
  vec3 light = vec3(0); float through = 1.;
  if (from < to) {
    float steps = min(600., ceil((to - from) / stride)), step = (to - from) / steps;
    for (float n = .5; n < steps; ++n) {
      vec4 v = texture(points, (eye + (from + n * step) * way) / size + .5);
      light += through * step * brightest * v.rgb * v.rgb;
      through *= exp(-step * densest * v.a);
    }
    light *= gain / 255.;
    for (int end = 0; end < 2; ++end) {
      vec3 left = .5 * size - abs(eye + (end == 0 ? from : to) * way);
      float thin = .004 * max(size.x, max(size.y, size.z));
      if (dot(vec3(lessThan(left, vec3(thin))), vec3(1)) > 1.5) light += vec3(end == 0 ? .12 : .06);
    }
  }
  colour = vec4(light, 1);
}`;
)";

constexpr const char* kScript = R"(
for (const box of document.querySelectorAll('.turn')) {
  const canvas = box.querySelector('canvas'), told = JSON.parse(canvas.dataset.volume);
  const knob = name => box.querySelector('[name=' + name + ']');
  const state = () => ['turn', 'tilt', 'zoom', 'gain'].map(name => +knob(name).value);
  const fail = why => { canvas.hidden = true; box.querySelector('.knobs').hidden = true;
    box.querySelector('.note').textContent = why + ' The slices and projections below show the volume too.'; };
  const gl = canvas.getContext('webgl2', {antialias: false});
  if (!gl) { fail('This browser has no WebGL2, so the volume cannot be turned here.'); continue; }
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source); gl.compileShader(shader); gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) { fail('WebGL2 does not work here.'); continue; }
  gl.useProgram(program);
  const place = name => gl.getUniformLocation(program, name);
  const size = told.points.map(n => n * told.edge), longest = Math.hypot(...size);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const sum = (a, x, b, y) => a.map((v, i) => x * v + y * b[i]);
  const cross = (a, b) => [0, 1, 2].map(i => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
  const unit = a => a.map(v => v / Math.sqrt(dot(a, a)));
  let due = false, ready = false;
  const draw = () => {
    due = false;
    if (!ready) return;
    const side = Math.min(900, Math.round(canvas.clientWidth * Math.min(devicePixelRatio, 1.5)));
    const high = Math.min(side, Math.round(side * canvas.clientHeight / canvas.clientWidth));
    if (canvas.width !== side || canvas.height !== high) { canvas.width = side; canvas.height = high; }
    const [turn, tilt, zoom, gain] = state(), [across, away, up] = told.axes, rad = Math.PI / 180;
    const level = sum(across, Math.cos(turn * rad), away, Math.sin(turn * rad));
    const out = sum(level, Math.cos(tilt * rad), up, Math.sin(tilt * rad));
    const right = unit(cross(up, level)), upwards = cross(out, right);
    const pixels = Math.min(side, high);
    gl.viewport(0, 0, side, high);
    gl.uniform2f(place('whole'), side, high); gl.uniform3fv(place('size'), size); gl.uniform3fv(place('eye'), out.map(v => 1.6 * longest * v));
    gl.uniform3fv(place('right'), right); gl.uniform3fv(place('upwards'), upwards);
    gl.uniform3fv(place('forward'), out.map(v => -v));
    gl.uniform1f(place('pixels'), pixels); gl.uniform1f(place('zoom'), 2.6 * Math.pow(2, zoom));
    gl.uniform1f(place('stride'), .7 * told.edge); gl.uniform1f(place('gain'), Math.pow(2, gain));
    gl.uniform1f(place('brightest'), told.brightest); gl.uniform1f(place('densest'), told.densest);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };
  const later = () => { if (!due) { due = true; requestAnimationFrame(draw); } };
  const set = (name, value) => { const k = knob(name);
    if (name === 'turn') value = ((value + 180) % 360 + 360) % 360 - 180;
    k.value = Math.max(+k.min, Math.min(+k.max, value)); later(); };
  const values = picture => {
    const c = document.createElement('canvas'); c.width = picture.naturalWidth; c.height = picture.naturalHeight;
    const context = c.getContext('2d'); context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, c.width, c.height).data;
  };
  const pictures = [...box.querySelectorAll('img')];
  Promise.all(pictures.map(p => p.decode())).then(() => {
    const [nx, ny, nz] = told.points, columns = told.columns, light = values(pictures[0]);
    const density = pictures[1] ? values(pictures[1]) : null, all = new Uint8Array(4 * nx * ny * nz);
    let to = 0;
    for (let k = 0; k < nz; ++k) for (let j = 0; j < ny; ++j) for (let i = 0; i < nx; ++i, to += 4) {
      const from = 4 * ((Math.floor(k / columns) * ny + j) * nx * columns + (k % columns) * nx + i);
      for (let c = 0; c < 3; ++c) all[to + c] = light[from + c];
      all[to + 3] = density ? density[from] : 0;
    }
    gl.bindTexture(gl.TEXTURE_3D, gl.createTexture());
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_3D, filter, gl.LINEAR);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R])
      gl.texParameteri(gl.TEXTURE_3D, wrap, gl.CLAMP_TO_EDGE);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA8, nx, ny, nz, 0, gl.RGBA, gl.UNSIGNED_BYTE, all);
    ready = true; canvas.dataset.ready = 'yes'; later();
  }).catch(() => fail('The volume in this page cannot be read.'));
  const fingers = new Map();
  canvas.addEventListener('pointerdown', e => { fingers.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); });
  for (const over of ['pointerup', 'pointercancel']) canvas.addEventListener(over, e => fingers.delete(e.pointerId));
  canvas.addEventListener('pointermove', e => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const other = [...fingers.values()].find(f => f.pointerId !== e.pointerId);
    if (other) {
      const far = f => Math.hypot(f.clientX - other.clientX, f.clientY - other.clientY) || 1;
      set('zoom', +knob('zoom').value + Math.log2(far(e) / far(before)));
    } else {
      set('turn', +knob('turn').value - .5 * (e.clientX - before.clientX));
      set('tilt', +knob('tilt').value + .5 * (e.clientY - before.clientY));
    }
    fingers.set(e.pointerId, e);
  });
  canvas.addEventListener('wheel', e => { if (document.activeElement !== canvas) return;
    e.preventDefault(); set('zoom', +knob('zoom').value - e.deltaY / 400); }, {passive: false});
  const first = state();
  const keys = {ArrowLeft: ['turn', -5], ArrowRight: ['turn', 5], ArrowUp: ['tilt', 5], ArrowDown: ['tilt', -5],
    '+': ['zoom', .25], '=': ['zoom', .25], '-': ['zoom', -.25], '[': ['gain', -.5], ']': ['gain', .5]};
  canvas.addEventListener('keydown', e => {
    if (e.key === 'Home') ['turn', 'tilt', 'zoom', 'gain'].forEach((name, i) => set(name, first[i]));
    else if (keys[e.key]) set(keys[e.key][0], +knob(keys[e.key][0]).value + keys[e.key][1]);
    else return;
    e.preventDefault();
  });
  for (const k of box.querySelectorAll('input')) k.addEventListener('input', later);
  addEventListener('resize', later);
}
)";

std::string knob(const char* name, const char* words, double least, double most, double step, double value) {
  return fmt::format(
      R"(<label>{}<input type="range" name="{}" min="{}" max="{}" step="{}" value="{:.1f}"></label>)", words,
      name, least, most, step, value);
}

/// A world direction as the script takes it.
std::string direction(int axis, double sign) {
  Eigen::Vector3d d = Eigen::Vector3d::Zero();
  d[axis] = sign;
  return fmt::format("[{},{},{}]", d.x(), d.y(), d.z());
}

std::string stored(const Image& picture) {
  return "<img hidden alt=\"\" src=\"" + png_data_uri(picture) + "\">";
}

}  // namespace

std::string volume_view_html(const SmallVolume& v, const ShownAxes& axes, const Eigen::Vector3d& from) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(v.points[2])));
  const Eigen::Vector3d shown = axes.shown(from);
  const double degrees = 180 / std::numbers::pi;
  const double turn = degrees * std::atan2(shown.y(), shown.x());
  const double tilt = degrees * std::atan2(shown.z(), std::hypot(shown.x(), shown.y()));
  std::string html = kTurnStyle;
  html += fmt::format(
      R"(<div class="turn"><canvas tabindex="0" role="img" aria-label="The volume, to turn: arrow keys turn and )"
      R"(tilt it, + and - zoom, [ and ] change the brightness, Home goes back" data-volume='{{"points":[{},{},{}],)"
      R"("edge":{:.9g},"brightest":{:.9g},"densest":{:.9g},"columns":{},"axes":[{},{},{}]}}'></canvas>)",
      v.points[0], v.points[1], v.points[2], v.edge, v.brightest, v.densest, columns,
      direction(axes.across, 1), direction(axes.away, 1), direction(axes.up, axes.sign));
  html +=
      "<p class=\"note\">Drag to turn, pinch or use the wheel (after a click) to zoom; arrow keys, + and -, "
      "[ and ] do the same. At brightness 0 it is as bright as a camera far away would film it.</p>"
      "<noscript><p>Without scripts the volume can't be turned; the slices below show it too.</p></noscript>";
  html += "<div class=\"knobs\">" + knob("turn", "turn", -180, 180, 0.5, turn) +
          knob("tilt", "tilt", -89, 89, 0.5, std::clamp(tilt, -89.0, 89.0)) +
          knob("zoom", "zoom", -1.5, 3, 0.05, 0) + knob("gain", "brightness", -4, 8, 0.1, 0) + "</div>";
  html += stored(light_atlas(v, columns));
  if (v.densest > 0) html += stored(density_atlas(v, columns));
  return html + "</div><script>(() => {" + kShaders + kScript + "})();</script>";
}

}  // namespace emberlock::report
