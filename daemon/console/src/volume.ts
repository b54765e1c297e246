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

import type {Volume} from './wire';

type Colour = readonly [number, number, number, number];  // brightness of a voxel; red, green, blue
const kGlow: readonly Colour[] = [[0, 0, 0, 0], [40, 0.35, 0.02, 0.02], [110, 0.9, 0.3, 0.02], [190, 1, 0.75, 0.2], [255, 1, 1, 0.85]];
const kGrey: readonly Colour[] = [[0, 0, 0, 0], [255, 1, 1, 1]];

export class VolumeView {
  private readonly window = vtkGenericRenderWindow.newInstance({background: [0.03, 0.04, 0.05]});
  private readonly mapper = vtkVolumeMapper.newInstance();
  private readonly actor = vtkVolume.newInstance();
  private readonly colours = vtkColorTransferFunction.newInstance();
  private size = '';
  private grey?: boolean;

  constructor(container: HTMLElement) {
    this.window.setContainer(container);
    this.actor.setMapper(this.mapper);
    const property = this.actor.getProperty();
    const opacity = vtkPiecewiseFunction.newInstance();
    for (const [at, value] of [[0, 0], [8, 0], [60, 0.05], [140, 0.22], [255, 0.6]] as const) opacity.addPoint(at, value);
    property.setRGBTransferFunction(0, this.colours);
    this.colour(false);
    property.setScalarOpacity(0, opacity);
    property.setInterpolationTypeToLinear();
    this.window.getRenderer().addVolume(this.actor);
    this.mapper.setMaximumSamplesPerRay(400);
    new ResizeObserver(() => this.window.resize()).observe(container);
  }

  show(header: Volume, voxels: Uint8Array): void {
    const {nx, ny, nz} = header;
    if (voxels.length !== nx * ny * nz) throw new Error(`a volume of ${nx} x ${ny} x ${nz} voxels with ${voxels.length} bytes`);
    const size = header.box?.size ?? [1, 1, 1];
    const center = header.box?.center ?? [0, 0, 0];
    const spacing = [size[0]! / nx, size[1]! / ny, size[2]! / nz];
    const image = vtkImageData.newInstance();
    image.setDimensions(nx, ny, nz);
    image.setSpacing([spacing[0]!, spacing[1]!, spacing[2]!]);
    image.setOrigin([0, 1, 2].map(axis => center[axis]! - size[axis]! / 2 + spacing[axis]! / 2) as [number, number, number]);
    image.getPointData().setScalars(vtkDataArray.newInstance({name: 'brightness', numberOfComponents: 1, values: voxels}));
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

  /** Grey, or as a flame glows: through red and orange to nearly white. */
  colour(grey: boolean): void {
    if (grey === this.grey) return;
    this.grey = grey;
    this.colours.removeAllPoints();
    for (const [at, ...rgb] of grey ? kGrey : kGlow) this.colours.addRGBPoint(at, ...rgb);
    this.window.getRenderWindow().render();
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
