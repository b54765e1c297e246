// SPDX-License-Identifier: Apache-2.0
// The script of the page that `emberlock view` writes: the header is the element #emberlock-result, the blocks follow as .emberlock-block.
import '../style.css';
import './viewer.css';

import {el} from '../dom';
import {readContents} from './contents';
import {ResultPage} from './page';

declare global {
  interface Window {
    emberlockViewer?: ResultPage;
    emberlockFirstPicture?: number;  // ms since the page was asked for
  }
}

async function begin(): Promise<void> {
  const header = document.getElementById('emberlock-result')?.textContent ?? '';
  const blocks = [...document.querySelectorAll('.emberlock-block')];
  const page = new ResultPage(readContents(header), index => blocks[index]?.textContent ?? '');
  document.body.append(page.root);
  await page.start();
  window.emberlockViewer = page;
  window.emberlockFirstPicture = performance.now();
}

begin().catch(error => document.body.append(el('p', {class: 'viewer fault', role: 'alert'}, `This page can’t show its volume: ${error instanceof Error ? error.message : String(error)}.`)));
