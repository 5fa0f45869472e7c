//! Arguments of `unlift audit images`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift::obfuscate::Entry;
use unlift::recover::Builtin;
use unlift_nn::DescriptorKind;

use crate::args::audit::{AttackArgs, ResultArgs, RunArgs};
use crate::values::{self, NeighborSource};

/// Options of `audit images`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift audit images photos
  unlift audit images features.h5 --photos photos --solver joint,ransac --out audit
  unlift audit images PROJECT/database.db --max-images 100 --schemes lines2d --inlier-ratios 1,0.5
  unlift audit images photos --neighbors oracle --neighbors similarity --neighbors overlap
  unlift audit images photos --features aliked --neighbors descriptors
  unlift audit images photos --gate 'cp2d@0.5:10<=20' --share-safe --json

Photos are JPEG, PNG or WebP files at any depth; features are those of unlift features.
Figures are over the keypoints of all images; lengths are in pixels.

Gates are those of unlift audit map. An image that cannot be used gets one line on stderr and is
counted in audit.json; the others are audited, and the exit code is 3.

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input, be it a single image.")]
pub struct AuditImagesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Which features of photos: sift, aliked, or superpoint, whose weights you supply (see unlift
    /// models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::feature_type, help_heading = "Input")]
    pub features: Option<DescriptorKind>,
    /// Features wanted per photo; sift: coarse ones first, and the last scale is kept whole, others:
    /// the best [default: 8192, aliked 2048, superpoint 4096]
    #[arg(long, value_parser = values::count, value_name = "N", help_heading = "Input")]
    pub max_features: Option<NonZeroUsize>,
    /// Score that a keypoint must exceed, not for sift [default: aliked 0.2, superpoint
    /// 0.005]
    #[arg(long, value_name = "SCORE", value_parser = values::score, help_heading = "Input")]
    pub min_score: Option<f32>,
    /// Use at most this many images, evenly spaced over their sorted names
    #[arg(long, value_parser = values::count, value_name = "N", help_heading = "Input")]
    pub max_images: Option<NonZeroUsize>,
    /// True neighbors per keypoint
    #[arg(long, value_name = "K", default_value = "20", help_heading = "Input",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// The integer that all randomness comes from
    #[arg(long, value_name = "INTEGER", default_value_t = 0, help_heading = "Input")]
    pub seed: u64,
    /// Schemes to audit, by commas [default: lines2d,cp2d,dcl2d]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::image_scheme,
          help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    /// Recovery methods, by commas or repeated: joint, joint-start, consensus, ransac [default: joint, and
    /// joint-start, the pass that it begins with]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::image_solver,
          help_heading = "Attack")]
    pub solver: Vec<Builtin>,
    /// Where neighborhoods come from, repeatable: oracle (made from the keypoints themselves), or what
    /// an attacker makes from the released descriptors: descriptors (the best that they allow without training),
    /// similarity, overlap (SIFT), learned (a network; SIFT or ALIKED)
    #[arg(long, value_name = "oracle|SOURCE", value_parser = values::image_source,
          default_value = "oracle", help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    #[command(flatten)]
    pub attack: AttackArgs,
    /// Errors in pixels up to which a keypoint counts as recovered, by commas; kept as typed
    /// [default: 1,5,10,25]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold,
          help_heading = "Result")]
    pub thresholds: Vec<Threshold>,
    /// Draw this image in the report; repeatable [default: the least, the median and the most recovered]
    #[arg(long, value_name = "NAME", help_heading = "Result", conflicts_with = "share_safe")]
    pub show: Vec<String>,
    /// Folder of the photos, when PATH is a file: to draw, and to compare with (--invert). They are
    /// turned by EXIF only if the file says that its features are of upright photos
    #[arg(long, value_name = "DIR", help_heading = "Result")]
    pub photos: Option<PathBuf>,
    /// Paint what came back and compare with the photos: rows get ssim, psnr and lpips, and the
    /// report the pictures
    #[arg(long, help_heading = "Result")]
    pub invert: bool,
    /// Paint with this network in place of the one known for the descriptors: ONNX, as
    /// training/inversion exports it
    #[arg(long, value_name = "FILE", help_heading = "Result", requires = "invert")]
    pub inverter: Option<PathBuf>,
    #[command(flatten)]
    pub result: ResultArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
