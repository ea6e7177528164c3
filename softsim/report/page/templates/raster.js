// Triangles in space on a grid of pixels that keeps the depth of what is nearest: bodies that bend
// around each other cover each other rightly, and 20,000 triangles take a few milliseconds.

const FINER = 2; // pixels of the grid along one of the canvas: edges are smooth

class Raster {
  constructor(width, height) {
    this.width = Math.max(1, Math.round(FINER * width));
    this.height = Math.max(1, Math.round(FINER * height));
    this.image = new ImageData(this.width, this.height);
    this.colours = new Uint32Array(this.image.data.buffer); // 0xAABBGGRR
    this.depths = new Float32Array(this.width * this.height).fill(-Infinity);
  }

  // A triangle of one colour; its corners x, y in pixels of the canvas, and depth towards the eye.
  fill(ax, ay, az, bx, by, bz, cx, cy, cz, colour) {
    const x0 = FINER * ax - 0.5, y0 = FINER * ay - 0.5; // of a, from the middle of the first pixel
    const bX = FINER * (bx - ax), bY = FINER * (by - ay);
    const cX = FINER * (cx - ax), cY = FINER * (cy - ay);
    const area = bX * cY - bY * cX;
    if (area === 0) return;
    // Shares of the corners b, c and a: they change along x and y, and a has all of itself.
    const shares = [[cY / area, -cX / area, 0], [-bY / area, bX / area, 0],
      [(bY - cY) / area, (cX - bX) / area, 1]];
    const [alongX, alongY] = [0, 1].map((k) =>
      shares[0][k] * (bz - az) + shares[1][k] * (cz - az)); // change of the depth
    const top = Math.max(0, Math.ceil(y0 + Math.min(0, bY, cY)));
    const bottom = Math.min(this.height - 1, Math.floor(y0 + Math.max(0, bY, cY)));
    for (let row = top; row <= bottom; row++) {
      const y = row - y0;
      let left = Math.max(0, Math.ceil(x0 + Math.min(0, bX, cX)));
      let right = Math.min(this.width - 1, Math.floor(x0 + Math.max(0, bX, cX)));
      for (const [toX, toY, own] of shares) { // inside, none is negative
        const end = x0 - (toY * y + own) / toX;
        if (toX > 0) left = Math.max(left, Math.ceil(end));
        else if (toX < 0) right = Math.min(right, Math.floor(end));
      }
      for (let column = left; column <= right; column++) {
        const depth = az + alongX * (column - x0) + alongY * y, pixel = row * this.width + column;
        if (depth <= this.depths[pixel]) continue;
        this.depths[pixel] = depth;
        this.colours[pixel] = colour;
      }
    }
  }

  // Put the picture on a canvas of this size, smoothed.
  show(context, width, height) {
    const grid = new OffscreenCanvas(this.width, this.height);
    grid.getContext("2d").putImageData(this.image, 0, 0);
    context.imageSmoothingQuality = "high";
    context.drawImage(grid, 0, 0, width, height);
  }
}
