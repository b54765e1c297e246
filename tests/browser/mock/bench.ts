// SPDX-License-Identifier: Apache-2.0
// What the tests before the mock share: a browser a file, a mock a test, and pages that the browser may not complain of.
import {fileURLToPath} from 'node:url';

import type {Browser, Page} from 'playwright-core';
import {afterAll, afterEach, beforeAll, beforeEach, expect} from 'vitest';

import {Mock} from './mock';
import {lampPictures} from './pictures';
import {openPage, startChromium, type Watched} from '../support/chromium';

export const kConsole = process.env.EMBERLOCK_CONSOLE ?? fileURLToPath(new URL('../../../build/release/console', import.meta.url));
export const kSizes = [{width: 1600, height: 900}, {width: 1280, height: 720}, {width: 390, height: 844}] as const;
export const kPhone = kSizes[2];

export interface Bench {
  browser: Browser;
  mock: Mock;
  lamp: Uint8Array[];
  open(size?: {width: number; height: number}): Promise<Page>;
}

export function bench(): Bench {
  const opened: Watched[] = [];
  const shared = {
    async open(size: {width: number; height: number} = kSizes[0]): Promise<Page> {
      const watched = await openPage(shared.browser, shared.mock.url, size);
      opened.push(watched);
      await watched.page.waitForSelector('.link[data-connection=open]', {state: 'attached'});
      return watched.page;
    },
  } as Bench;
  beforeAll(async () => {
    shared.browser = await startChromium();
    shared.lamp = await lampPictures(shared.browser, 1);
  });
  afterAll(() => shared.browser.close());
  beforeEach(async () => {
    shared.mock = new Mock(kConsole);
    shared.mock.jpeg = () => shared.lamp[0];
    await shared.mock.start();
  });
  afterEach(async () => {
    const complaints = opened.flatMap(each => each.complaints);
    for (const {page} of opened.splice(0)) await page.context().close();
    await shared.mock.stop();
    expect(complaints, 'what the browser complained of').toEqual([]);
  });
  return shared;
}

export const text = (page: Page, selector: string): Promise<string> => page.locator(selector).first().innerText();

/** So much that the page is wider than the screen. */
export const overflows = (page: Page): Promise<number> => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

/** Every camera's picture has come and is drawn. */
export const drawn = (page: Page, cameras: number): Promise<unknown> => page.waitForFunction(many => window.emberlockDiagnostics.shown.size >= many, cameras);
