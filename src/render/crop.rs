//! Crop: a part of a picture, in pixels of the whole.

use serde::Serialize;
use thiserror::Error;

/// A rectangle of pixels. The first column is `x0`, the last one `x1 - 1`; rows count from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Window {
    /// Column of its left edge.
    pub x0: u32,
    /// Row of its top edge.
    pub y0: u32,
    /// Column behind its right edge.
    pub x1: u32,
    /// Row below its bottom edge.
    pub y1: u32,
}

/// A crop that is not a part of the picture.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "the crop {x0} {y0} {x1} {y1} is not a part of a picture of {width}x{height} pixels; give \
     X0 Y0 X1 Y1 with X0 < X1 <= {width} and Y0 < Y1 <= {height} (X1 and Y1 are not in it)",
    x0 = window.x0, y0 = window.y0, x1 = window.x1, y1 = window.y1
)]
pub struct CropError {
    window: Window,
    width: u32,
    height: u32,
}

impl Window {
    /// All of a picture.
    pub fn whole(width: u32, height: u32) -> Window {
        Window { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// The window itself, if it is a part of a picture and has a pixel.
    ///
    /// # Errors
    /// If it is not.
    pub fn inside(self, width: u32, height: u32) -> Result<Window, CropError> {
        let Window { x0, y0, x1, y1 } = self;
        match x0 < x1 && x1 <= width && y0 < y1 && y1 <= height {
            true => Ok(self),
            false => Err(CropError { window: self, width, height }),
        }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_is_a_part_of_the_picture_with_a_pixel() {
        let window = |[x0, y0, x1, y1]: [u32; 4]| Window { x0, y0, x1, y1 };
        for good in [[0, 0, 8, 6], [7, 5, 8, 6], [0, 0, 1, 1]] {
            assert_eq!(window(good).inside(8, 6), Ok(window(good)));
        }
        for bad in [[0, 0, 9, 6], [0, 0, 8, 7], [3, 0, 3, 6], [4, 0, 3, 6], [0, 6, 8, 6]] {
            let error = window(bad).inside(8, 6).unwrap_err().to_string();
            assert!(error.contains("8x6") && error.contains("X0 < X1 <= 8"), "{error}");
        }
    }
}
