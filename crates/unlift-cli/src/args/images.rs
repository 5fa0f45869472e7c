//! Arguments of what is done with photos and pictures.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift_nn::DescriptorKind;

use crate::values;

/// Options of `features`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift features photos --out features.h5
  unlift features photos --max-features 2048 --first-octave 0
  unlift features photos --type aliked --out features.h5
  unlift features PROJECT/database.db --out features.h5

Photos are JPEG, PNG or WebP files at any depth, named relative to the folder. Features are SIFT as
COLMAP extracts it, descriptors bytes: RootSIFT times 512; or learned ones, descriptors floats of
length 1 (see unlift models). Features of a file are copied, not extracted.

Photos are turned upright by their EXIF orientation, and keypoints are in pixels of the upright
photo; the file says so (attribute upright of keypoints). For a COLMAP model or hloc, which do not
turn photos, give --as-stored.

A run that is interrupted goes on where it was when the same command is given again: finished images
wait in FILE.parts, which is gone when FILE is there. An image that cannot be used gets one line;
the others are written, and the exit code is 3.

Exit codes: 0 done, 2 usage, 3 bad input, be it a single image.")]
pub struct FeaturesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    #[arg(value_name = "IMAGES")]
    pub images: PathBuf,
    /// File to write (HDF5, hloc's layout)
    #[arg(long, value_name = "FILE", default_value = "features.h5")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Which features: sift, aliked, or superpoint, whose weights you supply (see unlift
    /// models) [default: sift]
    #[arg(long = "type", value_name = "TYPE", value_parser = values::feature_type)]
    pub kind: Option<DescriptorKind>,
    /// Features wanted per photo; sift: coarse ones first, and the last scale is kept whole, others:
    /// the best [default: 8192, aliked 2048, superpoint 4096]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_features: Option<NonZeroUsize>,
    /// Score that a keypoint must exceed, not for sift [default: aliked 0.2, superpoint
    /// 0.005]
    #[arg(long, value_name = "SCORE", value_parser = values::score)]
    pub min_score: Option<f32>,
    /// Leave photos as they are stored, as COLMAP and hloc do; else they are turned upright by their
    /// EXIF orientation
    #[arg(long)]
    pub as_stored: bool,
    /// Longest side in pixels; larger photos are shrunk, their keypoints are in pixels of the photo
    /// [default: 3200, others 1600]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65536))]
    pub max_image_size: Option<u32>,
    /// -1 doubles the photo first and finds the finest features, 0 does not and takes a third of the
    /// time; sift only [default: -1]
    #[arg(long, value_name = "OCTAVE", allow_hyphen_values = true,
          value_parser = clap::value_parser!(i8).range(-1..=0))]
    pub first_octave: Option<i8>,
    /// Threads to use; never changes a byte [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// Options of `invert`.
#[derive(Debug, Args)]
#[command(after_help = "\
One PNG per image, of half its size, under the image's name with .png behind. Networks: see
unlift models.

Examples:
  unlift invert photos --out pictures                                     of the keypoints themselves
  unlift invert hidden/released.parquet --recovered back.parquet --out pictures
  unlift invert hidden/released.parquet --recovered back.parquet --cameras PROJECT/sparse/0 --scale 1 \
    --out pictures                                                        of a map, by its cameras")]
pub struct InvertArgs {
    /// A folder of photos, hloc's features.h5, a COLMAP database.db, or released images or a released map
    /// (released.parquet)
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Which features of photos: sift, aliked, or superpoint, whose weights you supply (see unlift
    /// models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::feature_type)]
    pub features: Option<DescriptorKind>,
    /// What came back of the released images or map
    #[arg(long, value_name = "FILE")]
    pub recovered: Option<PathBuf>,
    /// COLMAP model whose cameras see the map; for maps only
    #[arg(long, value_name = "MODEL", requires = "recovered", requires = "scale")]
    pub cameras: Option<PathBuf>,
    /// Units of the released map per unit of that model: the --scale it was obfuscated with
    #[arg(long, value_name = "SCALE", value_parser = values::positive, requires = "cameras")]
    pub scale: Option<f64>,
    /// Paint with this network in place of the one known for the descriptors: ONNX, as
    /// training/inversion exports it
    #[arg(long, value_name = "FILE")]
    pub inverter: Option<PathBuf>,
    /// Paint at most this many images, evenly spaced over their names; of released images the first ones
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_images: Option<NonZeroUsize>,
    /// Threads to use; never changes a result [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Folder to write
    #[arg(long, value_name = "DIR", default_value = "unlift-pictures")]
    pub out: PathBuf,
    /// Replace files of these names that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `metrics`.
#[derive(Debug, Args)]
#[command(after_help = "\
SSIM as scikit-image has it by default (7 x 7 windows, mean of the colors), PSNR in dB, LPIPS 0.1 on
SqueezeNet. Of folders, pictures of the same name are compared, whatever their extension. A picture of
twice the other's size is halved first.

Examples:
  unlift metrics photo.jpg picture.png
  unlift metrics photos pictures --json")]
pub struct MetricsArgs {
    /// A picture, or a folder of pictures
    pub a: PathBuf,
    /// Another of the same size or half or twice that, or a folder of these
    pub b: PathBuf,
    /// Print an object with ssim, psnr and lpips in place of the text; of folders, such means and `pictures`
    #[arg(long)]
    pub json: bool,
}
