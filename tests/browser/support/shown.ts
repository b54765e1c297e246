// SPDX-License-Identifier: Apache-2.0
// What is to be seen on the page: numbers in texts, and pixels.
import type {Locator, Page} from 'playwright-core';

/** The numbers of a text as the page writes them: "−13 834 µs" is -13834. */
export function numbers(words: string): number[] {
  return [...words.matchAll(/[−+-]?\d[\d ]*(\.\d+)?/g)].map(([found]) => Number(found.replaceAll(' ', '').replace('−', '-')));
}

export function number(words: string): number {
  return numbers(words)[0] ?? NaN;
}

/** "5 min 24 s", "98 s", "1 h 02 min" in seconds. */
export function seconds(words: string): number {
  const unit = {h: 3600, min: 60, s: 1};
  return [...words.matchAll(/([\d.]+) (h|min|s)\b/g)].reduce((sum, [, value, name]) => sum + Number(value) * unit[name as keyof typeof unit], 0);
}

/** A list of <dt> and <dd> as an object. */
export async function facts(list: Locator): Promise<Record<string, string>> {
  return Object.fromEntries(await list.locator('dt').evaluateAll(names => names.map(name => [name.textContent!, name.nextElementSibling!.textContent!])));
}

/** Grey levels, row by row, of a part of the page as it is seen, at most 160 wide. */
export async function grey(page: Page, part: Locator): Promise<{width: number; height: number; levels: number[]}> {
  const png = (await part.screenshot()).toString('base64');
  return page.evaluate(async data => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(data), letter => letter.charCodeAt(0))]));
    const scale = Math.min(1, 160 / bitmap.width);
    const canvas = new OffscreenCanvas(Math.round(bitmap.width * scale), Math.round(bitmap.height * scale));
    const context = canvas.getContext('2d')!;
    context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
    const bytes = context.getImageData(0, 0, canvas.width, canvas.height).data;
    const levels = [];
    for (let at = 0; at < bytes.length; at += 4) levels.push((bytes[at]! + bytes[at + 1]! + bytes[at + 2]!) / 3);
    return {width: canvas.width, height: canvas.height, levels};
  }, png);
}

/** How alike two pictures are: 1 the same but for brightness and contrast, 0 not at all. */
export function correlation(a: number[], b: number[]): number {
  const mean = (list: number[]) => list.reduce((sum, value) => sum + value, 0) / list.length;
  const [ma, mb] = [mean(a), mean(b)];
  const product = (x: number[], mx: number, y: number[], my: number) => x.reduce((sum, value, at) => sum + (value - mx) * (y[at]! - my), 0);
  return product(a, ma, b, mb) / Math.sqrt(product(a, ma, a, ma) * product(b, mb, b, mb));
}
