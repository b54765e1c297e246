// SPDX-License-Identifier: Apache-2.0
// What edits a stylization: tools that make steps, on the picture of a view or by numbers.
import type {Box, StylizationStatus_View as View} from '../api.gen';

/** In a view's pixels, from its top left corner. */
export interface Point {
  x: number;
  y: number;
}

/** A step without its pass, as apply/edit_file.h has it. */
export type Operation = {op: string} & Record<string, unknown>;

/** Of an object, PNGs in base64. */
export interface Pictures {
  picture: string;
  mask?: string;
}

/** What tools work at. */
export interface Bench {
  /** The view whose picture is edited; undefined before one is known. */
  readonly view: View | undefined;
  /** All whose pictures are fitted. */
  readonly inputs: readonly View[];
  /** Where the volume is; undefined before one came. */
  readonly box: Box | undefined;
  /** Tells the daemon, one step after the other. True: it was taken, and the picture shows it. */
  send(operation: Operation, pictures?: Pictures): Promise<boolean>;
  /** What the tools draw over the picture has changed. */
  redraw(): void;
}

export interface Tool {
  readonly name: string;
  readonly hint: string;
  readonly root: HTMLElement;
  // On the picture; a tool without these is none for it.
  down?(at: Point): void;
  /** While it is held down. */
  drag?(at: Point): void;
  up?(at: Point): void;
  wheel?(by: number): void;
  /** In the view's pixels; `unit` of them are one of the screen's. */
  draw?(context: CanvasRenderingContext2D, unit: number, pointer?: Point): void;
  /** Another view, or another volume, is at hand. */
  changed?(): void;
}

export function distance(a: Point, b: Point): number {
  return Math.hypot(a.x - b.x, a.y - b.y);
}

/** As a step has it: a tenth of a pixel is enough. */
export function place({x, y}: Point): [number, number] {
  return [Math.round(10 * x) / 10, Math.round(10 * y) / 10];
}
