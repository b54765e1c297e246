// SPDX-License-Identifier: Apache-2.0
// The march of shaders.ts in WebGPU's language, step by step the same. Light and what comes through are two pictures.
import {kCells} from './bricks';
import {type Kind, kTold} from './march';

const kHead = `
@group(0) @binding(0) var<uniform> told: array<vec4f, ${kTold}>;  // March.asTold()
@group(0) @binding(1) var values: texture_3d<f32>;
@group(0) @binding(2) var emptiness: texture_3d<u32>;
@group(0) @binding(3) var colours: texture_2d<f32>;
@group(0) @binding(4) var smoothly: sampler;
const kThrough = 1. / 512.;
const UNTOLD = -1e30;
const UNSEEN = -3e30;  // what was leapt over
struct Out { @location(0) light: vec4f, @location(1) through: vec4f }

@vertex fn whole(@builtin(vertex_index) n: u32) -> @builtin(position) vec4f {
  return vec4f(select(-1., 3., n == 1u), select(-1., 3., n == 2u), 0., 1.);
}
fn at(p: vec3f) -> vec4f { return textureSampleLevel(values, smoothly, (p + .5) / told[5].xyz, 0.); }
fn hueOf(share: f32) -> vec4f { return textureSampleLevel(colours, smoothly, vec2f((255. * clamp(share, 0., 1.) + .5) / 256., .5), 0.); }
fn quotient(v: vec4f) -> f32 { return select(UNTOLD, v.x / max(v.y, .02), v.y > .02); }
fn bandOf(value: f32) -> i32 { return select(i32(dot(step(told[9], vec4f(value)), vec4f(1.))), -1, value == UNTOLD); }
`;

interface Steps {
  begin: string;
  sample: string;
  stopped: string;
  leapt: string;
  end: string;
}

const kMarch = ({begin, sample, stopped, leapt, end}: Steps) => `${kHead}
@fragment fn march(@builtin(position) spot: vec4f) -> Out {
  let eye = told[0].xyz;
  let bricks = vec3i(told[6].xyz);
  let scale = told[7];
  let range = told[8];
  let levels = told[9];
  let pixel = (spot.xy - told[4].zw) / told[4].xy;
  var way = normalize(told[1].xyz * pixel.x + told[2].xyz * pixel.y + told[3].xyz);
  way += select(vec3f(0.), vec3f(1e-9), way == vec3f(0.));
  let toLow = -eye / way;
  let toHigh = (told[5].xyz - 1. - eye) / way;
  let near = min(toLow, toHigh);
  let far = max(toLow, toHigh);
  let begins = max(0., max(near.x, max(near.y, near.z)));
  let ends = min(far.x, min(far.y, far.z));
  var through = 1.;
  var light = vec3f(0.);
  var p = vec3f(0.);
  var n = 0;
  let count = select(0, i32(ceil((ends - begins) / told[1].w)), begins < ends);
  let stretch = select(0., (ends - begins) / f32(max(count, 1)), count > 0);
  let over = stretch * way;
  let start = eye + (begins + .5 * stretch) * way;
  var empty = true;
  var stop = false;
  ${begin}
  while (n < count && through > kThrough) {
    let here = start + f32(n) * over;
    let brick = clamp(vec3i(here) / ${kCells}, vec3i(0), bricks - 1);
    let leap = i32(textureLoad(emptiness, brick, 0).r);
    let low = vec3f(brick - max(leap - 1, 0)) * ${kCells}.;
    let high = vec3f(brick + max(leap, 1)) * ${kCells}.;
    let borders = (select(low, high, way > vec3f(0.)) - start) / over;
    let last = min(count, max(n, i32(floor(min(borders.x, min(borders.y, borders.z))))) + 1);
    if (leap == 0 || !empty) {
      stop = false;
      for (; n < last && !stop; n++) {
        p = start + f32(n) * over;
        ${sample}
      }
      ${stopped}
    } else {
      n = last;
      ${leapt}
    }
  }
  ${end}
  return Out(vec4f(light, 1.), vec4f(through));
}`;

const kColour = (absorbs: boolean) => kMarch({begin: '', stopped: '', leapt: '', sample: absorbs ? `
        let v = scale * at(p);
        let depth = v.w * stretch;
        let taken = select(1. - exp(-depth), depth * (1. - depth * (.5 - depth / 6.)), depth < .03);
        light += through * stretch * select(1., taken / depth, depth > 0.) * v.rgb;
        through *= 1. - taken;` : `
        light += stretch * scale.rgb * at(p).rgb;`, end: `
  light *= range.x / 255.;`});

const kQuantity = (surfaces: boolean) => kMarch({begin: `
  var value = UNTOLD;
  ${surfaces ? `
  var past = UNTOLD;
  var least = -2e30;
  var most = -1e29;
  let aside = normalize(cross(way, told[2].xyz));
  let athwart = cross(way, aside);` : ''}`, sample: `
        let v = at(p);
        ${surfaces ? 'past = value;' : ''}
        value = quotient(v);
        let share = (value - range.x) / (range.y - range.x);
        if (share > 0.) {
          let hue = hueOf(share);
          let opaque = 1. - exp(-range.z * v.y * hue.a * stretch);
          light += through * opaque * hue.rgb;
          through *= 1. - opaque;
        }
        ${surfaces ? 'stop = value < least || value >= most;' : ''}`, stopped: surfaces ? `
      if (stop) {
        if (past == UNSEEN) { past = quotient(at(p - over)); }
        let band = bandOf(value);
        let before = bandOf(past);
        let up = select(-1, 1, band > before);
        if (min(band, before) >= 0) {
          for (var m = before; m != band; m += up) {
            let level = levels[min(m, m + up)];
            let along = (value - past) / stretch;
            let q = mix(p - over, p, (level - past) / (value - past));
            var facing = .5;
            if (through > .03) {
              let a = at(q + aside);
              let b = at(q - .5 * aside + .866 * athwart);
              let c = at(q - .5 * aside - .866 * athwart);
              let f = vec3f(a.x, b.x, c.x) / max(vec3f(a.y, b.y, c.y), vec3f(.02));
              let apart = f - f.yzx;
              facing = abs(along) * inverseSqrt(along * along + 2. / 9. * dot(apart, apart) + 1e-30);
            }
            light += through * .7 * (.35 + .65 * facing) * hueOf((level - range.x) / (range.y - range.x)).rgb;
            through *= .3;
          }
        }
        least = select(select(levels[max(band - 1, 0)], -1e29, band == 0), -2e30, band < 0);
        most = select(select(1e30, levels[min(band, 3)], band < 4), -1e29, band < 0);
        empty = band <= 0;
      }` : '', leapt: surfaces ? 'value = UNSEEN;' : '', end: ''});

export const kGpuShaders: Record<Kind, string> = {light: kColour(false), absorbed: kColour(true), quantity: kQuantity(false), surfaces: kQuantity(true)};
