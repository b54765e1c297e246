import {expect, test} from 'vitest';

import type {DaemonStatus} from '../../../daemon/console/src/api.gen';
import {decode, unpack} from '../../../daemon/console/src/wire';
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
