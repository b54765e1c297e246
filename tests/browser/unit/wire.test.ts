// SPDX-License-Identifier: Apache-2.0
import {afterEach, expect, test, vi} from 'vitest';

import type {DaemonStatus, ListDevicesResponse} from '../../../daemon/console/src/api.gen';
import {decode, follow, unpack} from '../../../daemon/console/src/wire';
import {pack} from '../mock/mock';

test('what protobuf leaves out of its JSON gets its default, and what is optional stays absent', () => {
  const status = decode('DaemonStatus', {phase: 'LOCKED', cameras: [{id: 'a', error_rows: 0}]}) as DaemonStatus;
  expect(status).toMatchObject({revision: 0, phase: 'LOCKED', light: 'LIGHT_UNSPECIFIED', reason: '', faults: []});
  expect(status.alignment).toBeUndefined();
  expect(status.cameras[0]).toMatchObject({state: 'STATE_UNSPECIFIED', reset: 'SHUTTER_RESET_UNSPECIFIED', sensor: 'CCD', resets: 0, reset_next: false, dots: [], error_rows: 0});
  expect(status.cameras[0]).not.toHaveProperty('drift_ppm');
});

test('64-bit numbers that come as strings, and NaN, become numbers', () => {
  const status = decode('DaemonStatus', {now_ns: '9007199254740991', alignment: {history: [{error_rows: [1.5, 'NaN', '-Infinity']}]}}) as DaemonStatus;
  expect(status.now_ns).toBe(9007199254740991);
  expect(status.alignment!.history[0]!.error_rows).toEqual([1.5, NaN, -Infinity]);
});

test('devices come as messages: what nobody knows of one is absent, what it has none of is empty', () => {
  const list = decode('ListDevicesResponse', {cameras: [{id: 'a', reset: 'ON_COMMAND', modes: [{width: 1280, format: 'RGB8'}]}, {id: 'b', held_by: {pid: 7, program: 'cheese'}}]}) as ListDevicesResponse;
  expect(list).toMatchObject({serial_ports: [], failures: []});
  expect(list.cameras[0]).toMatchObject({id: 'a', reset: 'ON_COMMAND', external_trigger: false, notes: [], modes: [{width: 1280, height: 0, format: 'RGB8'}]});
  expect(list.cameras[0]).not.toHaveProperty('held_by');
  expect(list.cameras[1]!.held_by).toEqual({pid: 7, program: 'cheese'});
});

test('fields that a newer daemon adds are passed over', () => {
  expect(decode('Notice', {id: '4', text: 'x', colour: 'blue'})).toEqual({id: 4, light: 'LIGHT_UNSPECIFIED', utc: '', text: 'x'});
});

test('a binary message is its header and its bytes', () => {
  const message = pack({kind: 'picture', camera_id: 'virtual-00', frame_id: '7', monotonic_ns: '123456789', width: 4, height: 3}, new Uint8Array([255, 216, 1]));
  const [header, bytes] = unpack(new Uint8Array(message).buffer);
  expect(header).toEqual({kind: 'picture', camera_id: 'virtual-00', frame_id: 7, monotonic_ns: 123456789, width: 4, height: 3});
  expect([...bytes]).toEqual([255, 216, 1]);
});

test('a binary message that is cut short is an error', () => {
  expect(() => unpack(new Uint8Array([1, 0]).buffer)).toThrow('without its header');
  expect(() => unpack(new Uint8Array([9, 0, 0, 0, 123]).buffer)).toThrow('shorter');
});

/** A daemon that answers a job with these pieces of its stream, and then ends it or breaks off. */
function answerWith(pieces: string[], end: 'ends' | 'breaks' = 'ends'): void {
  const body = new ReadableStream<Uint8Array>({
    start(stream) {
      for (const piece of pieces) stream.enqueue(new TextEncoder().encode(piece));
      if (end === 'ends') stream.close();
      else setTimeout(() => stream.error(new TypeError('network error')), 0);
    },
  });
  vi.stubGlobal('fetch', () => Promise.resolve(new Response(body)));
}
const verified = (told: string[] = []) => follow('Sessions/Verify', {session: 's'}, progress => told.push(progress.doing));
afterEach(() => vi.unstubAllGlobals());

test('a job is told line by line, however its bytes come, and its last line is what came of it', async () => {
  answerWith(['{"doing": "rea', 'ds"}\n{"doing": "checks"}\n', '{"state": "DONE", "outcome": {"ok": true, "salvage": {"events_kept": "3"}}}\n']);
  const told: string[] = [];
  expect(await verified(told)).toMatchObject({state: 'DONE', outcome: {ok: true, salvage: {events_kept: 3}}});
  expect(told).toEqual(['reads', 'checks', '']);
});

test('a job that fails on its way is an error, in the daemon\u2019s words', async () => {
  answerWith(['{"doing": "reads"}\n{"code": "INTERNAL", "message": "exports: no space left on device."}\n']);
  await expect(verified()).rejects.toMatchObject({code: 'INTERNAL', message: 'exports: no space left on device.'});
});

test('a stream that ends without its last line is an error, wherever it is cut', async () => {
  const lines = '{"doing": "reads"}\n{"state": "DONE"}\n';
  for (let length = 0; length < lines.length; ++length) {
    answerWith([lines.slice(0, length)], length % 2 === 0 ? 'ends' : 'breaks');
    await expect(verified(), `${length} bytes`).rejects.toThrow('broke off');
  }
});
