//! Object detection in pictures.
//!
//! Only objects of everyday classes are detected. To protect the people in the photos, text is not read and faces are not compared.

use crate::features::ColorImage;
use crate::network::{Network, Tensor};
use unlift::Error;

const MODEL: &str = "yolox-nano";
/// Side of the network's input.
const SIDE: usize = 416;
/// Padding around a picture that is not square.
const GRAY: u8 = 114;
/// Strides of the three grids of predictions.
const STRIDES: [usize; 3] = [8, 16, 32];
/// Numbers of a prediction before its classes: position, size, objectness.
const BEFORE: usize = 5;
/// Boxes of one class with a larger overlap are one object.
const OVERLAP: f32 = 0.45;

/// The classes of COCO, by number.
#[rustfmt::skip]
pub const CLASSES: [&str; 80] = [
    "person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "traffic light", "fire hydrant",
    "stop sign", "parking meter", "bench", "bird", "cat", "dog", "horse", "sheep", "cow", "elephant", "bear", "zebra",
    "giraffe", "backpack", "umbrella", "handbag", "tie", "suitcase", "frisbee", "skis", "snowboard", "sports ball", "kite",
    "baseball bat", "baseball glove", "skateboard", "surfboard", "tennis racket", "bottle", "wine glass", "cup", "fork",
    "knife", "spoon", "bowl", "banana", "apple", "sandwich", "orange", "broccoli", "carrot", "hot dog", "pizza", "donut",
    "cake", "chair", "couch", "potted plant", "bed", "dining table", "toilet", "tv", "laptop", "mouse", "remote",
    "keyboard", "cell phone", "microwave", "oven", "toaster", "sink", "refrigerator", "book", "clock", "vase", "scissors",
    "teddy bear", "hair drier", "toothbrush",
];

/// An object in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Index of its class in [`CLASSES`].
    pub class: usize,
    /// Confidence of the detector, 0 to 1.
    pub score: f32,
    /// Left, top, right and bottom in pixels from the corner; may exceed the picture.
    pub sides: [f32; 4],
}

impl Detection {
    /// Returns the intersection over union of both boxes.
    pub fn overlap(&self, other: &Self) -> f32 {
        let side = |at: usize| {
            let low = self.sides[at].max(other.sides[at]);
            (self.sides[at + 2].min(other.sides[at + 2]) - low).max(0.0)
        };
        let area = |sides: [f32; 4]| (sides[2] - sides[0]) * (sides[3] - sides[1]);
        let both = side(0) * side(1);
        let either = area(self.sides) + area(other.sides) - both;
        if either > 0.0 { both / either } else { 0.0 }
    }
}

/// A detector of objects.
#[derive(Debug)]
pub struct Detector {
    network: Network,
}

impl Detector {
    /// Loads the embedded detector, or the file that replaces it.
    pub fn try_new() -> Result<Self, Error> {
        Ok(Self { network: Network::load(MODEL)? })
    }

    /// Finds the objects in `picture` with a score above `min_score`, the highest first.
    pub fn find(&self, picture: &ColorImage, min_score: f32) -> Result<Vec<Detection>, Error> {
        let (input, scale) = resized(picture)?;
        let [output] = self.network.run(vec![("images", input)], ["output"])?;
        let grids = STRIDES.into_iter().flat_map(|stride| {
            let side = SIDE / stride;
            (0..side * side).map(move |at| (stride as f32, [at % side, at / side]))
        });
        let rows = output.values().chunks_exact(BEFORE + CLASSES.len());
        let mut candidates = Vec::new();
        for ((stride, cell), row) in grids.zip(rows) {
            for (class, likely) in row[BEFORE..].iter().enumerate() {
                let score = row[4] * likely;
                if score > min_score {
                    let middle = [0, 1].map(|c| (row[c] + cell[c] as f32) * stride / scale);
                    let half = [0, 1].map(|c| libm::expf(row[2 + c]) * stride / scale / 2.0);
                    let [left, top] = [0, 1].map(|c| middle[c] - half[c]);
                    let [right, bottom] = [0, 1].map(|c| middle[c] + half[c]);
                    let sides = [left, top, right, bottom];
                    candidates.push(Detection { class, score, sides });
                }
            }
        }
        // The sort is stable, so equal scores keep the order of cells.
        candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut kept: Vec<Detection> = Vec::new();
        for new in candidates {
            if !kept.iter().any(|k| k.class == new.class && k.overlap(&new) > OVERLAP) {
                kept.push(new);
            }
        }
        Ok(kept)
    }
}

/// Resizes the picture to the network's input, in BGR, and returns the scale.
fn resized(picture: &ColorImage) -> Result<(Tensor, f32), Error> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let scale = (SIDE as f64 / height as f64).min(SIDE as f64 / width as f64);
    let [wide, high] = [width, height].map(|side| ((side as f64 * scale) as usize).clamp(1, SIDE));
    let mut values = vec![f32::from(GRAY); 3 * SIDE * SIDE];
    // Bilinear with aligned pixel centers, as in OpenCV.
    let between = |at: usize, from: usize, to: usize| {
        let x = ((at as f64 + 0.5) * from as f64 / to as f64 - 0.5).clamp(0.0, from as f64 - 1.0);
        (x as usize, ((x as usize) + 1).min(from - 1), (x - x.floor()) as f32)
    };
    for y in 0..high {
        let (top, bottom, down) = between(y, height, high);
        for x in 0..wide {
            let (left, right, across) = between(x, width, wide);
            let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
            let [a, b, c, d] = corners.map(|(x, y)| picture.get_pixel(x as u32, y as u32).0);
            for color in 0..3 {
                let mix = |a: u8, b: u8| f32::from(a) * (1.0 - across) + f32::from(b) * across;
                let value = mix(a[color], b[color]) * (1.0 - down) + mix(c[color], d[color]) * down;
                values[((2 - color) * SIDE + y) * SIDE + x] = value.round();
            }
        }
    }
    Ok((Tensor::try_new(&[1, 3, SIDE, SIDE], values)?, scale as f32))
}
