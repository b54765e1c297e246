// SPDX-License-Identifier: Apache-2.0
// What a region of the volume looks like from a view: lines in its picture's pixels.
import type {Point} from './tool';

export type Triple = [number, number, number];
interface Region {
  center: Triple;  // metres
  size: Triple;
}

const kParts = 48;  // of a round line

/** Of a place in metres; undefined: it isn't before the camera. `matrix` is pixel_from_world, 3 x 4. */
export function project([x, y, z]: Triple, matrix: readonly number[]): Point | undefined {
  const [u, v, w] = [0, 4, 8].map(row => matrix[row]! * x + matrix[row + 1]! * y + matrix[row + 2]! * z + matrix[row + 3]!) as Triple;
  return w > 0 ? {x: u / w, y: v / w} : undefined;
}

function seen(places: Triple[], matrix: readonly number[]): Point[] {
  return places.map(place => project(place, matrix)).filter(point => point !== undefined);
}

/** `by` runs from -1 to 1 along each axis of the region. */
function at({center, size}: Region, by: Triple): Triple {
  return [0, 1, 2].map(axis => center[axis]! + by[axis]! * size[axis]! / 2) as Triple;
}

/** A box's twelve edges. */
export function edgesOf(region: Region, matrix: readonly number[]): Point[][] {
  const lines: Point[][] = [];
  for (let axis = 0; axis < 3; ++axis) {
    for (const a of [-1, 1]) {
      for (const b of [-1, 1]) {
        const ends = [-1, 1].map(along => {
          const by: Triple = [0, 0, 0];
          by[axis] = along;
          by[(axis + 1) % 3] = a;
          by[(axis + 2) % 3] = b;
          return at(region, by);
        });
        lines.push(seen(ends, matrix));
      }
    }
  }
  return lines;
}

/** An ellipsoid's three sections through its middle. */
export function ellipses(region: Region, matrix: readonly number[]): Point[][] {
  return [0, 1, 2].map(axis => seen(Array.from({length: kParts + 1}, (_, part) => {
    const angle = 2 * Math.PI * part / kParts;
    const by: Triple = [0, 0, 0];
    by[(axis + 1) % 3] = Math.cos(angle);
    by[(axis + 2) % 3] = Math.sin(angle);
    return at(region, by);
  }), matrix));
}
