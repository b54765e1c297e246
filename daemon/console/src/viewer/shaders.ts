// SPDX-License-Identifier: Apache-2.0
// The march: a ray through each pixel's middle, in voxel edges from key point (0, 0, 0), sampled in the middle of equal steps. What is
// empty is leapt over by bricks, and a ray ends where nearly nothing comes through any more.

export const kWhole = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1), 0, 1); }`;

const kHead = `#version 300 es
precision highp float; precision highp sampler3D; precision highp usampler3D; precision highp int;
uniform sampler3D values;
uniform usampler3D emptiness;   // bricks to the next that isn't empty; 0 in such ones
uniform sampler2D colours;      // of 256 values, in alpha their opacity
uniform vec4 told[TOLD];        // March.asTold()
#define eye told[0].xyz
#define rows told[0].w
#define axes mat3(told[1].xyz, told[2].xyz, told[3].xyz)
#define stride told[1].w
#define lens told[4]
#define points told[5].xyz
#define bricks ivec3(told[6].xyz)
out vec4 colour;
const float kThrough = 1. / 512., UNTOLD = -1e30, UNSEEN = -3e30;  // what is not told; what was leapt over
`;

interface Steps {
  begin: string;
  sample: string;   // at p; `stop` ends the run within a brick
  stopped: string;  // after such a run
  leapt: string;    // after what is empty, before sample n
  end: string;
}

const kMarch = ({begin, sample, stopped, leapt, end}: Steps) => `${kHead}
vec4 at(vec3 p) { return texture(values, (p + .5) / points); }
vec4 hueOf(float share) { return texture(colours, vec2((255. * clamp(share, 0., 1.) + .5) / 256., .5)); }
float quotient(vec4 v) { return v.y > .02 ? v.x / v.y : UNTOLD; }
int bandOf(float value) { return value == UNTOLD ? -1 : int(dot(step(told[9], vec4(value)), vec4(1))); }
void main() {
  vec4 scale = told[7], range = told[8], levels = told[9];
  vec2 pixel = (vec2(gl_FragCoord.x, rows - gl_FragCoord.y) - lens.zw) / lens.xy;
  vec3 way = normalize(axes * vec3(pixel, 1.));
  way += vec3(equal(way, vec3(0))) * 1e-9;
  vec3 toLow = -eye / way, toHigh = (points - 1. - eye) / way;
  vec3 near = min(toLow, toHigh), far = max(toLow, toHigh);
  float from = max(0., max(near.x, max(near.y, near.z))), to = min(far.x, min(far.y, far.z));
  float through = 1.;
  vec3 light = vec3(0), p = vec3(0);
  int n = 0, count = from < to ? int(ceil((to - from) / stride)) : 0;
  float stretch = count > 0 ? (to - from) / float(count) : 0.;
  vec3 over = stretch * way, start = eye + (from + .5 * stretch) * way;
  bool empty = true, stop = false;
  ${begin}
  while (n < count && through > kThrough) {
    vec3 here = start + float(n) * over;
    ivec3 brick = clamp(ivec3(here) / CELLS, ivec3(0), bricks - 1);
    int leap = int(texelFetch(emptiness, brick, 0).r);
    vec3 low = vec3(brick - max(leap - 1, 0)) * float(CELLS), high = vec3(brick + max(leap, 1)) * float(CELLS);
    vec3 ends = (mix(low, high, greaterThan(way, vec3(0))) - start) / over;
    int last = min(count, max(n, int(floor(min(ends.x, min(ends.y, ends.z))))) + 1);
    if (leap == 0 || !empty) {
      for (stop = false; n < last && !stop; ++n) {
        p = start + float(n) * over;
        ${sample}
      }
      ${stopped}
    } else {
      n = last;
      ${leapt}
    }
  }
  ${end}
}`;

/** dL = S ds and the extinction in w, as recon's march: L += T S ds phi(x), T *= exp(-x) with x = sigma ds, phi(x) = (1 - exp(-x)) / x. */
const kColour = (absorbs: boolean) => kMarch({begin: '', stopped: '', leapt: '', sample: absorbs ? `
      vec4 v = scale * at(p);
      float depth = v.w * stretch;
      float taken = depth < .03 ? depth * (1. - depth * (.5 - depth / 6.)) : 1. - exp(-depth);
      light += through * stretch * (depth > 0. ? taken / depth : 1.) * v.rgb;
      through *= 1. - taken;` : `
      light += stretch * scale.rgb * at(p).rgb;`, end: `
  colour = vec4(light * range.x / 255., through);`});

/** A quantity in colours and as opaque as the palette has it: x holds it times y, which is 1 where it is told, so that what isn't told doesn't
 *  mix in. Isotherms are surfaces: a run of samples stops where it leaves its band of values. */
const kQuantity = (surfaces: boolean) => kMarch({begin: surfaces ? `
  float past = UNTOLD, value = UNTOLD, least = -2e30, most = -1e29;  // of the present band, which is that of what isn't told
  vec3 aside = normalize(cross(way, told[2].xyz)), athwart = cross(way, aside);` : 'float past = UNTOLD, value = UNTOLD;', sample: `
      vec4 v = at(p);
      past = value;
      value = quotient(v);
      float share = (value - range.x) / (range.y - range.x);
      if (share > 0.) {
        vec4 hue = hueOf(share);
        float opaque = 1. - exp(-range.z * v.y * hue.a * stretch);
        light += through * opaque * hue.rgb;
        through *= 1. - opaque;
      }
      ${surfaces ? 'stop = value < least || value >= most;' : ''}`, stopped: surfaces ? `
      if (stop) {
        if (past == UNSEEN) past = quotient(at(p - over));
        int band = bandOf(value);
        int before = bandOf(past), up = band > before ? 1 : -1;
        if (min(band, before) >= 0) for (int m = before; m != band; m += up) {
          float level = levels[min(m, m + up)], along = (value - past) / stretch;
          // The slope across the ray, of three places around it.
          vec3 q = mix(p - over, p, (level - past) / (value - past));
          float facing = .5;
          if (through > .03) {  // else it is hardly seen
            vec4 a = at(q + aside), b = at(q - .5 * aside + .866 * athwart), c = at(q - .5 * aside - .866 * athwart);
            vec3 f = vec3(a.x, b.x, c.x) / max(vec3(a.y, b.y, c.y), .02), apart = f - f.yzx;
            facing = abs(along) * inversesqrt(along * along + 2. / 9. * dot(apart, apart) + 1e-30);
          }
          light += through * .7 * (.35 + .65 * facing) * hueOf((level - range.x) / (range.y - range.x)).rgb;
          through *= .3;
        }
        least = band < 0 ? -2e30 : band == 0 ? -1e29 : levels[band - 1];
        most = band < 0 ? -1e29 : band < 4 ? levels[band] : 1e30;
        empty = band <= 0;
      }` : '', leapt: surfaces ? 'value = UNSEEN;' : '', end: `
  colour = vec4(light, through);`});

export const kFragments = {light: kColour(false), absorbed: kColour(true), quantity: kQuantity(false), surfaces: kQuantity(true)};

/** What another renderer drew, its first row on top: light, and how much comes through. */
export const kLaid = `#version 300 es
precision highp float;
uniform sampler2D light, through;
out vec4 colour;
void main() {
  ivec2 spot = ivec2(gl_FragCoord.x, float(textureSize(light, 0).y) - gl_FragCoord.y);
  colour = vec4(texelFetch(light, spot, 0).rgb, texelFetch(through, spot, 0).r);
}`;

/** Cameras in space: their pictures, and the lines of their pyramids. */
export const kPlaced = `#version 300 es
uniform vec3 eye; uniform mat3 axes; uniform vec4 lens; uniform vec2 whole;
layout(location = 0) in vec3 place; layout(location = 1) in vec2 spot;
out vec2 where;
void main() {
  where = spot;
  vec3 way = (place - eye) * axes;    // what is seen: right, down, forward
  vec2 pixel = lens.xy * way.xy + lens.zw * way.z;
  gl_Position = vec4((2. * pixel / whole - way.z) * vec2(1, -1), 0., way.z);
}`;
export const kPicture = `#version 300 es
precision highp float;
uniform sampler2D picture; uniform float share;
in vec2 where; out vec4 colour;
void main() { colour = vec4(texture(picture, where).rgb * share, 1. - share); }`;
export const kLines = `#version 300 es
precision highp float;
uniform vec4 ink;
in vec2 where; out vec4 colour;
void main() { colour = vec4(ink.rgb * ink.a, 1. - ink.a); }`;
