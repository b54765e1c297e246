// SPDX-License-Identifier: Apache-2.0
// An object's picture from any file that the browser reads: as PNGs of its colours and, where it is transparent, of its opacity.
import type {Pictures} from './tool';

const kLongest = 1024;            // px: more than a view shows of it
const kMostBytes = 1.2 * 2 ** 20; // of each, so that both fit into a message to the daemon

export interface ObjectPicture extends Pictures {
  /** As it is sent. */
  canvas: HTMLCanvasElement;
}

async function pngOf(canvas: HTMLCanvasElement): Promise<Uint8Array> {
  const blob = await new Promise<Blob | null>(resolve => canvas.toBlob(resolve, 'image/png'));
  return new Uint8Array(await blob!.arrayBuffer());
}

function base64(bytes: Uint8Array): string {
  let letters = '';
  for (let at = 0; at < bytes.length; at += 8192) letters += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(letters);
}

function drawn(bitmap: ImageBitmap, scale: number): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = Math.max(1, Math.round(scale * bitmap.width));
  canvas.height = Math.max(1, Math.round(scale * bitmap.height));
  const context = canvas.getContext('2d')!;
  context.imageSmoothingQuality = 'high';
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  return canvas;
}

/** Its opacity as grey; undefined: it is opaque. */
function opacityOf(canvas: HTMLCanvasElement): HTMLCanvasElement | undefined {
  const {width, height} = canvas;
  const image = canvas.getContext('2d')!.getImageData(0, 0, width, height);
  let clear = false;
  for (let at = 0; at < image.data.length; at += 4) {
    const alpha = image.data[at + 3]!;
    clear ||= alpha < 255;
    image.data.set([alpha, alpha, alpha, 255], at);
  }
  if (!clear) return undefined;
  const mask = document.createElement('canvas');
  mask.width = width;
  mask.height = height;
  mask.getContext('2d')!.putImageData(image, 0, 0);
  return mask;
}

/** Rejects where the file is no picture. */
export async function readPicture(file: Blob): Promise<ObjectPicture> {
  const bitmap = await createImageBitmap(file);
  let scale = Math.min(1, kLongest / Math.max(bitmap.width, bitmap.height));
  for (;; scale /= 2) {
    const canvas = drawn(bitmap, scale);
    const opacity = opacityOf(canvas);
    const [picture, mask] = [await pngOf(canvas), opacity && await pngOf(opacity)];
    if (Math.max(picture.length, mask?.length ?? 0) > kMostBytes) continue;
    bitmap.close();
    return {canvas, picture: base64(picture), ...(mask && {mask: base64(mask)})};
  }
}
