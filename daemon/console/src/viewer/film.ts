// SPDX-License-Identifier: Apache-2.0
// Pictures and videos of what is shown, as files.
import {el} from '../dom';

export function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  el('a', {href: address, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

export async function screenshot(canvas: HTMLCanvasElement, name: string): Promise<void> {
  const blob = await new Promise<Blob | null>(resolve => canvas.toBlob(resolve, 'image/png'));
  if (!blob) throw new Error('the picture can’t be read');
  save(blob, name);
}

const kTypes = ['video/mp4;codecs=avc1', 'video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
const kRate = 24;

/** Films one turn that lasts `seconds`; `draw(share)` puts 0..1 of it on the canvas. A machine that is slow films fewer pictures, not a
 *  longer turn. `going` ends it early. */
export async function turntable(canvas: HTMLCanvasElement, seconds: number, draw: (share: number) => void, going: () => boolean): Promise<Blob> {
  const type = kTypes.find(one => MediaRecorder.isTypeSupported(one));
  if (type === undefined) throw new Error('this browser records no video');
  const stream = canvas.captureStream(0);
  const track = stream.getVideoTracks()[0] as CanvasCaptureMediaStreamTrack;
  const recorder = new MediaRecorder(stream, {mimeType: type, videoBitsPerSecond: 8_000_000});
  const parts: Blob[] = [];
  recorder.ondataavailable = event => parts.push(event.data);
  const over = new Promise<void>((resolve, reject) => {
    recorder.onstop = () => resolve();
    recorder.onerror = () => reject(new Error('the video can’t be recorded'));
  });
  recorder.start();
  const begin = performance.now();
  for (let share = 0; share < 1 && going(); share = (performance.now() - begin) / 1000 / seconds) {
    const due = performance.now() + 1000 / kRate;
    draw(share);
    track.requestFrame();
    await new Promise(resolve => setTimeout(resolve, Math.max(0, due - performance.now())));
  }
  recorder.stop();
  await over;
  track.stop();
  return new Blob(parts, {type: type.split(';')[0]!});
}
