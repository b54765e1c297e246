// SPDX-License-Identifier: Apache-2.0
// From where the volume is seen: around it, or as one of the cameras that filmed it did.
import type {FilmingCamera, Triple} from './contents';

export const add = (a: Triple, b: Triple, times = 1): Triple => [a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]];
export const dot = (a: Triple, b: Triple): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Triple, b: Triple): Triple => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a: Triple): Triple => add([0, 0, 0], a, 1 / Math.hypot(...a));

/** A pinhole in the world, metres and pixels. */
export interface Eye {
  place: Triple;
  right: Triple;
  down: Triple;
  forward: Triple;
  focal: readonly [number, number];
  middle: readonly [number, number];
}

/** Where a place of the world is seen, in pixels, and how far before the eye; behind it where that isn't positive. */
export function seen(eye: Eye, world: Triple): Triple {
  const way = add(world, eye.place, -1);
  const far = dot(way, eye.forward);
  return [eye.middle[0] + eye.focal[0] * dot(way, eye.right) / far, eye.middle[1] + eye.focal[1] * dot(way, eye.down) / far, far];
}

export function placeOf({rotation: r, translation: t}: FilmingCamera): Triple {
  return [0, 1, 2].map(axis => -(r[axis]! * t[0] + r[3 + axis]! * t[1] + r[6 + axis]! * t[2])) as unknown as Triple;
}

/** As a camera saw it, its whole picture fitted into this one. */
export function eyeOf(camera: FilmingCamera, width: number, height: number): Eye {
  const r = camera.rotation as readonly [number, number, number, number, number, number, number, number, number];
  const share = Math.min(width / camera.size[0], height / camera.size[1]);
  return {
    place: placeOf(camera), right: [r[0], r[1], r[2]], down: [r[3], r[4], r[5]], forward: [r[6], r[7], r[8]],
    focal: [share * camera.focal[0], share * camera.focal[1]],
    middle: [width / 2 + share * (camera.middle[0] - camera.size[0] / 2), height / 2 + share * (camera.middle[1] - camera.size[1] / 2)],
  };
}

/** Two level directions, so that they and `up` are right-handed. */
function level(up: Triple): [Triple, Triple] {
  const axis: Triple = Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const across = unit(add(axis, up, -dot(axis, up)));
  return [across, cross(up, across)];
}

const kSteepest = 89;

/** Turned around a place, upright. */
export class Orbit {
  turn = -60;       // degrees
  tilt = 15;
  distance: number;
  private readonly axes: [Triple, Triple];

  constructor(readonly about: Triple, private readonly up: Triple, private readonly reach: number) {
    this.axes = level(up);
    this.distance = 3.2 * reach;
  }

  by(turn: number, tilt: number): void {
    this.turn = ((this.turn + turn + 180) % 360 + 360) % 360 - 180;
    this.tilt = Math.max(-kSteepest, Math.min(kSteepest, this.tilt + tilt));
  }

  zoom(factor: number): void {
    this.distance = Math.max(0.3 * this.reach, Math.min(30 * this.reach, this.distance / factor));
  }

  /** From where a place of the world lies. */
  from(place: Triple): void {
    const way = unit(add(place, this.about, -1));
    this.turn = Math.atan2(dot(way, this.axes[1]), dot(way, this.axes[0])) * 180 / Math.PI;
    this.tilt = 0;
    this.by(0, Math.asin(Math.max(-1, Math.min(1, dot(way, this.up)))) * 180 / Math.PI);
  }

  eye(width: number, height: number): Eye {
    const [turn, tilt] = [this.turn, this.tilt].map(degrees => degrees * Math.PI / 180) as [number, number];
    const side = add(add([0, 0, 0], this.axes[0], Math.cos(turn)), this.axes[1], Math.sin(turn));
    const out = add(add([0, 0, 0], side, Math.cos(tilt)), this.up, Math.sin(tilt));
    const forward: Triple = [-out[0], -out[1], -out[2]];
    const right = unit(cross(forward, this.up));
    const focal = Math.min(width, height) / 2 / Math.tan(20 * Math.PI / 180);  // 40 degrees, as `emberlock render` has it
    return {place: add(this.about, out, this.distance), right, down: cross(forward, right), forward, focal: [focal, focal], middle: [width / 2, height / 2]};
  }
}
