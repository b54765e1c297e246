// SPDX-License-Identifier: Apache-2.0
// Pictures on canvases: each shows its newest alone, and all that are ready are drawn in one animation frame.
import {diagnostics} from './diagnostics';
import {el} from './dom';
import type {Picture} from './wire';

const kColourless = 8;  // grey levels between two colours that rounding leaves

export async function bitmapOf(jpeg: Uint8Array): Promise<ImageBitmap> {
  return createImageBitmap(new Blob([jpeg as BlobPart], {type: 'image/jpeg'}));
}

export function paint(canvas: HTMLCanvasElement, bitmap: ImageBitmap): void {
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    canvas.width = bitmap.width;
    canvas.height = bitmap.height;
  }
  canvas.getContext('2d', {alpha: false})!.drawImage(bitmap, 0, 0);
  bitmap.close();
}

/** Whether a picture has no colours: a grey camera's. */
export function isGrey(canvas: HTMLCanvasElement): boolean {
  const {data} = canvas.getContext('2d', {alpha: false})!.getImageData(0, 0, canvas.width, canvas.height);
  for (let at = 0; at < data.length; at += 4) {
    if (Math.max(data[at]!, data[at + 1]!, data[at + 2]!) - Math.min(data[at]!, data[at + 1]!, data[at + 2]!) > kColourless) return false;
  }
  return true;
}

export class LivePicture {
  readonly canvas = el('canvas', {width: 16, height: 9, 'aria-hidden': 'true'});
  private waiting?: [Picture, Uint8Array];
  private ready?: [Picture, ImageBitmap];
  private decoding = false;
  private newest = -Infinity;

  offer(header: Picture, jpeg: Uint8Array): void {
    if (header.monotonic_ns <= this.newest) return;
    this.newest = header.monotonic_ns;
    if (this.waiting) ++diagnostics.overtaken;
    this.waiting = [header, jpeg];
    if (!this.decoding) void this.decode();
  }

  /** Of another daemon, whose clock may begin anew. */
  restart(): void {
    this.newest = -Infinity;
  }

  draw(): Picture | undefined {
    if (!this.ready) return undefined;
    const [header, bitmap] = this.ready;
    this.ready = undefined;
    paint(this.canvas, bitmap);
    return header;
  }

  private async decode(): Promise<void> {
    this.decoding = true;
    while (this.waiting) {
      const [header, jpeg] = this.waiting;
      this.waiting = undefined;
      try {
        const bitmap = await bitmapOf(jpeg);
        if (this.ready) {
          this.ready[1].close();
          ++diagnostics.overtaken;
        }
        this.ready = [header, bitmap];
        schedule(this);
      } catch {
        ++diagnostics.damaged;
      }
    }
    this.decoding = false;
  }
}

const due = new Set<LivePicture>();

function schedule(picture: LivePicture): void {
  if (due.size === 0) requestAnimationFrame(drawAll);
  due.add(picture);
}

function drawAll(): void {
  const drawn: Picture[] = [];
  for (const picture of due) {
    const header = picture.draw();
    if (header) drawn.push(header);
  }
  due.clear();
  requestAnimationFrame(() => diagnostics.seen(drawn));
}
