// SPDX-License-Identifier: Apache-2.0
// `npm run mock`: serves the built console (EMBERLOCK_CONSOLE) before a mock that plays from idle to a volume, again and again.
import {startChromium} from '../support/chromium';
import {Mock} from './mock';
import {flamePictures, flameVolume, lampPictures} from './pictures';
import {aligning, capturing, idle, iteration, locked, reconstruction} from './scene';

const mock = new Mock(process.env.EMBERLOCK_CONSOLE ?? '../../build/release/console');
const browser = await startChromium();
const lamp = await lampPictures(browser, 6);
const flame = await flamePictures(browser, 12);
await browser.close();
mock.port = 8740;
await mock.start();
console.log(mock.url);
mock.jpeg = (_, frame) => lamp[frame % lamp.length];
const wait = (ms: number) => new Promise(resolve => setTimeout(resolve, ms));
for (;;) {
  mock.show(idle());
  await wait(5000);
  for (let round = 1; round <= 24; ++round) {
    mock.show(aligning(round));
    await wait(600);
  }
  mock.show(locked());
  mock.notice('GREEN', 'All cameras are locked.');
  await wait(4000);
  for (let tenths = 0; tenths < 80; ++tenths) {
    mock.show(capturing(tenths / 10));
    await wait(100);
  }
  mock.show({...locked(), recording: {...capturing(8).recording!, state: 'COMPLETE', verdict: '2112 frames, all accounted for.'}});
  for (let at = 1; at <= 12; ++at) {
    mock.show({reconstruction: reconstruction(at)});
    mock.tell({iteration: {reconstruction: 'r1', iteration: iteration(at), camera_id: 'virtual-03'}});
    mock.tellBytes({kind: 'captured', iteration: at, camera_id: 'virtual-03'}, flame[11]!);
    mock.tellBytes({kind: 'rendered', iteration: at, camera_id: 'virtual-03'}, flame[at - 1]!);
    const {header, bytes} = flameVolume();
    mock.tellBytes(header, bytes);
    await wait(1000);
  }
}
