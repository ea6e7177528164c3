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
    const toX = FINER * ax, toY = FINER * ay; // shares of the corners b and c are linear in x and y
    const bX = FINER * (bx - ax), bY = FINER * (by - ay);
    const cX = FINER * (cx - ax), cY = FINER * (cy - ay);
    const area = bX * cY - bY * cX;
    if (area === 0) return;
    const left = Math.max(0, Math.floor(toX + Math.min(0, bX, cX)));
    const right = Math.min(this.width - 1, Math.floor(toX + Math.max(0, bX, cX)));
    const top = Math.max(0, Math.floor(toY + Math.min(0, bY, cY)));
    const bottom = Math.min(this.height - 1, Math.floor(toY + Math.max(0, bY, cY)));
    for (let row = top; row <= bottom; row++) {
      const y = row + 0.5 - toY;
      for (let column = left; column <= right; column++) {
        const x = column + 0.5 - toX;
        const b = (x * cY - y * cX) / area, c = (y * bX - x * bY) / area;
        if (b < 0 || c < 0 || b + c > 1) continue;
        const depth = az + b * (bz - az) + c * (cz - az), pixel = row * this.width + column;
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
