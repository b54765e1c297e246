// SPDX-License-Identifier: Apache-2.0
import {expect, test} from 'vitest';

import {bytes, clock, count, micros, percent, ppm, reading, rows, sentence, short, span, tolerance} from '../../../daemon/console/src/format';

test('errors carry their sign and no more digits than matter', () => {
  expect([12.34, -0.26, 0, -0.04, 841.4, -99.46, 99.6].map(rows)).toEqual(['+12.3 rows', '−0.3 rows', '0.0 rows', '0.0 rows', '+841 rows', '−99.5 rows', '+100 rows']);
  expect([664e-6, -5.4e-3, 0.0412, 1.5, 0, 999.6e-6].map(short)).toEqual(['664 µs', '−5.40 ms', '41.2 ms', '1.50 s', '0 µs', '1.00 ms']);
  expect([664e-6, -13.8344e-3, 0, -0.4e-6].map(micros)).toEqual(['+664 µs', '−13 834 µs', '0 µs', '0 µs']);
  expect(ppm(-2.34)).toBe('−2.3 ppm');
});

test('a tolerance is told in time and in rows', () => {
  expect(tolerance(0.5e-3, 9.26)).toBe('500 µs (9.3 rows)');
  expect(tolerance(5.4e-3, 100)).toBe('5.40 ms (100 rows)');
});

test('a scale’s ends are told however small they are', () => {
  expect([0, 1900, 40, 0.5, 0.1, 0.0123, -0.0042, 3e-8].map(reading)).toEqual(['0', '1900', '40.0', '0.50', '0.10', '0.012', '−0.0042', '3.0e−8']);
});

test('lengths of time read as one says them', () => {
  expect([0, 3.21, 9.96, 48.4, 119.7, 200, 7325, -3].map(span)).toEqual(['0.0 s', '3.2 s', '10 s', '48 s', '2 min 00 s', '3 min 20 s', '2 h 02 min', '0 s']);
  expect([0, 7.39, 61, 761.04].map(clock)).toEqual(['0:00.0', '0:07.3', '1:01.0', '12:41.0']);
});

test('amounts', () => {
  expect([0, 999, 1000, 15.24e9, 999.6e6, 4.5e12].map(bytes)).toEqual(['0 B', '999 B', '1.00 kB', '15.2 GB', '1.00 GB', '4.50 TB']);
  expect(count(15840)).toBe('15 840');
  expect(percent(0.834)).toBe('83 %');
});

test('what is told begins and ends as a sentence', () => {
  expect(['it went away', 'cam-2: look at its cable.', 'Is it on?', ''].map(sentence)).toEqual(['It went away.', 'cam-2: look at its cable.', 'Is it on?', '']);
});

test('what is not known is a dash', () => {
  for (const format of [rows, micros, short, span, ppm]) expect([undefined, NaN, Infinity].map(format)).toEqual(['–', '–', '–']);
});
