// SPDX-License-Identifier: Apache-2.0
// The flame's volume, to be turned with the mouse. This file alone needs vtk.js: it is loaded when the first volume comes.
import '@kitware/vtk.js/Rendering/OpenGL/Profiles/Volume';

import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData';
import vtkPiecewiseFunction from '@kitware/vtk.js/Common/DataModel/PiecewiseFunction';
import vtkColorTransferFunction from '@kitware/vtk.js/Rendering/Core/ColorTransferFunction';
import vtkVolume from '@kitware/vtk.js/Rendering/Core/Volume';
import vtkVolumeMapper from '@kitware/vtk.js/Rendering/Core/VolumeMapper';
import vtkGenericRenderWindow from '@kitware/vtk.js/Rendering/Misc/GenericRenderWindow';

import {heat, spread} from './layers';
import type {Volume} from './wire';

type Colour = readonly [number, number, number, number];  // brightness of a voxel; red, green, blue
const kGlow: readonly Colour[] = [[0, 0, 0, 0], [40, 0.35, 0.02, 0.02], [110, 0.9, 0.3, 0.02], [190, 1, 0.75, 0.2], [255, 1, 1, 0.85]];
const kGrey: readonly Colour[] = [[0, 0, 0, 0], [255, 1, 1, 1]];
// Opacity of a voxel's brightness. What is measured shows the colours of what lies in front rather than all light along a ray.
const kClear = [[0, 0], [8, 0], [60, 0.05], [140, 0.22], [255, 0.6]] as const;
const kDense = [[0, 0], [6, 0], [16, 0.35], [80, 0.7], [255, 0.9]] as const;

/** Red, green and blue of each value, from the lowest byte up: the order in memory. */
const kHeatColours = Uint32Array.from({length: 256}, (_, value) => {
  const [red, green, blue] = heat(value);
  return red | green << 8 | blue << 16;
});

/** Red, green, blue and brightness of each voxel; nothing where nothing is told. */
function coloured(header: Volume, measured: Uint8Array, brightness: Uint8Array): Uint8Array {
  const out = new Uint32Array(measured.length);
  spread(header, measured).forEach((value, at) => { out[at] = kHeatColours[value]! | (measured[at] ? brightness[at]! : 0) << 24; });
  return new Uint8Array(out.buffer);
}

export class VolumeView {
  private readonly window = vtkGenericRenderWindow.newInstance({background: [0.03, 0.04, 0.05]});
  private readonly mapper = vtkVolumeMapper.newInstance();
  private readonly actor = vtkVolume.newInstance();
  private readonly colours = vtkColorTransferFunction.newInstance();
  private readonly opacity = vtkPiecewiseFunction.newInstance();
  private size = '';
  private shown: readonly unknown[] = [];

  constructor(container: HTMLElement) {
    this.window.setContainer(container);
    this.actor.setMapper(this.mapper);
    const property = this.actor.getProperty();
    property.setRGBTransferFunction(0, this.colours);
    property.setScalarOpacity(0, this.opacity);
    property.setIndependentComponents(false);  // of four: a colour, and what the opacity goes by
    property.setInterpolationTypeToLinear();
    this.window.getRenderer().addVolume(this.actor);
    this.mapper.setMaximumSamplesPerRay(400);
    new ResizeObserver(() => this.window.resize()).observe(container);
  }

  /** Its brightness, grey or as a flame glows, through red and orange to nearly white; or what is `measured`, as opaque as it is bright. */
  show(header: Volume, bytes: Uint8Array, grey: boolean, measured?: Uint8Array): void {
    const {nx, ny, nz} = header;
    const many = nx * ny * nz;
    if (bytes.length !== many * (1 + (header.layers ?? []).length)) throw new Error(`a volume of ${nx} x ${ny} x ${nz} voxels with ${bytes.length} bytes`);
    const brightness = bytes.subarray(0, many);
    this.colour(grey ? kGrey : kGlow, measured ? kDense : kClear);
    const size = header.box?.size ?? [1, 1, 1];
    const center = header.box?.center ?? [0, 0, 0];
    const spacing = [size[0]! / nx, size[1]! / ny, size[2]! / nz];
    const image = vtkImageData.newInstance();
    image.setDimensions(nx, ny, nz);
    image.setSpacing([spacing[0]!, spacing[1]!, spacing[2]!]);
    image.setOrigin([0, 1, 2].map(axis => center[axis]! - size[axis]! / 2 + spacing[axis]! / 2) as [number, number, number]);
    image.getPointData().setScalars(vtkDataArray.newInstance(measured
      ? {name: 'measured', numberOfComponents: 4, values: coloured(header, measured, brightness)}
      : {name: 'brightness', numberOfComponents: 1, values: brightness}));
    const step = Math.min(...spacing);
    this.mapper.setSampleDistance(step);
    this.actor.getProperty().setScalarOpacityUnitDistance(0, 3 * step);
    this.mapper.setInputData(image);
    // The operator's view stays from iteration to iteration, and from frame to frame.
    const key = JSON.stringify([size, center]);
    if (key !== this.size) {
      this.size = key;
      this.reset();
    }
    this.window.getRenderWindow().render();
  }

  private colour(colours: readonly Colour[], opacity: typeof kClear | typeof kDense): void {
    if (colours === this.shown[0] && opacity === this.shown[1]) return;
    this.shown = [colours, opacity];
    this.colours.removeAllPoints();
    for (const [at, ...rgb] of colours) this.colours.addRGBPoint(at, ...rgb);
    this.opacity.removeAllPoints();
    for (const [at, value] of opacity) this.opacity.addPoint(at, value);
  }

  /** From the side, upright. */
  reset(): void {
    const camera = this.window.getRenderer().getActiveCamera();
    camera.setFocalPoint(0, 0, 0);
    camera.setPosition(0.6, -1, 0.35);
    camera.setViewUp(0, 0, 1);
    this.window.getRenderer().resetCamera();
    this.window.getRenderWindow().render();
  }

  /** By degrees, around the upright axis and over it. */
  turn(azimuth: number, elevation: number): void {
    const renderer = this.window.getRenderer();
    const camera = renderer.getActiveCamera();
    camera.azimuth(azimuth);
    camera.elevation(elevation);
    camera.orthogonalizeViewUp();
    renderer.resetCameraClippingRange();
    this.window.getRenderWindow().render();
  }
}
