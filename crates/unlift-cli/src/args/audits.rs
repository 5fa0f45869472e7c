//! Arguments of audits: of a map, of images, of released records, and of those in a configuration.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta};
use unlift_audit::{Gate, OutlierFilter};
use unlift_nn::DescriptorKind;

use crate::values::{self, NeighborSource};

/// How the attacker works.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Attack")]
pub struct AttackArgs {
    /// Inlier ratios of the oracle: shares of listed neighbors that are true ones, separated by commas [default: 1,0.75,0.5,0.3,0.2,0.1]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::ratio)]
    pub inlier_ratios: Vec<f64>,
    /// How the oracle errs, by commas or repeated: uniform (any record), near (the 2K-th to 10K-th
    /// nearest), clustered (wrong places that neighbors share, as of look-alike descriptors) [default: uniform]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::noise)]
    pub oracle_noise: Vec<Noise>,
    /// Do not use constraints between records (cp: swaps are mutual; ray-voxel: parity)
    #[arg(long)]
    pub no_exact_constraints: bool,
    /// Add a row per scheme for an attacker who knows the positions of three true neighbors of every point
    #[arg(long)]
    pub reference: bool,
    /// Records per list of an attacker's own sources [default: each source's own choice]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    pub source_k: Option<u16>,
    /// Distance up to which a neighbor supports a position, in the unit of the audit
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// Average over this many random seeds
    #[arg(long, value_name = "N", default_value = "1",
          value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeats: u32,
}

/// What becomes of the figures.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Result")]
pub struct ResultArgs {
    /// Fail with exit code 1 if an attacker recovers more than this; repeatable, see below
    #[arg(long, value_name = "GATE", value_parser = Gate::parse)]
    pub gate: Vec<Gate>,
    /// Also write how the gates ended as JUnit XML, as GitLab, Jenkins and others show it
    #[arg(long, value_name = "FILE", requires = "gate")]
    pub junit: Option<PathBuf>,
    /// Also write the gates that failed as SARIF 2.1.0, as GitHub shows it
    #[arg(long, value_name = "FILE", requires = "gate")]
    pub sarif: Option<PathBuf>,
    /// Folder for report.html and audit.json (and clouds); whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-audit")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// A report that can be shown: figures only, no points, paths, names or hashes
    #[arg(long)]
    pub share_safe: bool,
    /// Print a summary as JSON on stdout in place of the table
    #[arg(long)]
    pub json: bool,
    /// The configuration and the line of it that ask for the audit, seen from where `check` was started.
    #[arg(skip)]
    pub asked_at: Option<(String, usize)>,
}

/// How the program runs.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Run")]
pub struct RunArgs {
    /// Threads to use; never changes a figure [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// What recovers a map.
#[derive(Clone, Debug, Args)]
pub struct SolverArgs {
    /// Recovery methods, by commas or repeated: joint, joint-start, consensus, ransac, density, tomography
    /// [default: joint, and joint-start, the pass that it begins with; consensus on maps of fewer than 150 x K points (7,500 by default)]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::solver,
          help_heading = "Attack")]
    pub solver: Vec<Builtin>,
    /// Skip the second baseline: attacks on the released records alone, without neighbors and
    /// descriptors
    #[arg(long, help_heading = "Attack")]
    pub no_records_alone: bool,
}

/// What is read, and what one unit of it means: shared by `audit map` and `obfuscate`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct MapArgs {
    /// Meters per unit of the map. Without it, lengths are in median distances to the K-th nearest neighbor
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Descriptors of the points: a COLMAP database.db or hloc's features.h5 that the model was made of,
    /// a .npy array with a row per point (of a COLMAP model by ascending point id), or a file that
    /// begins with P3DESC01
    #[arg(long, value_name = "FILE")]
    pub descriptors: Option<PathBuf>,
    /// Use a random subset of at most this many points
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Leave out points whose mean distance to this many neighbors exceeds the mean of all by more
    /// than RATIO standard deviations [default when given: 20,2.0]
    #[arg(long, value_name = "NEIGHBORS,RATIO", value_parser = values::outlier_filter,
          num_args = 0..=1, require_equals = true, default_missing_value = "20,2.0")]
    pub outlier_filter: Option<OutlierFilter>,
    /// True neighbors per point (K). Without --scale, the median distance to the K-th one is the unit of length
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// Random seed [default: 0 for audits; obfuscate uses a fresh key of 256 bits, because whoever guesses
    /// the seed can undo the hiding]
    #[arg(long, value_name = "INTEGER")]
    pub seed: Option<u64>,
}

/// Options of `audit map`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift audit map PROJECT --scale 1
  unlift audit map PROJECT --scale 1 --quick
  unlift audit map cloud.ply --schemes ppl,ppl+ --inlier-ratios 1,0.5 --out ppl-audit
  unlift audit map PROJECT --scale 1 --gate 'ppl@0.5:0.10<=20' --gate 'all:0.25:gain<=30'
  unlift audit map PROJECT --descriptors PROJECT/database.db --neighbors overlap \
    --gate 'all:overlap:1.0<=20'
  unlift audit map PROJECT --neighbors lists-by-point.parquet --solver joint,ransac
  unlift audit map PROJECT --descriptors PROJECT/database.db --neighbors oracle --neighbors overlap
  unlift audit map PROJECT --share-safe --json
  unlift audit map PROJECT --scale 1 --gate 'all@0.5:0.10<=20' --junit gates.xml --sarif gates.sarif

Gates: SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT. SCHEME may be all; without @RATIO
every ratio counts, without a solver or a source of neighborhoods every one; every noise model
counts; the largest figure decides, which is that of the strongest attack. :gain bounds what
neighborhoods add to an attacker without them (a blind guess, or what the records alone give, the
larger), in percentage points. A gate that names something not in the audit is a usage error; one on
a scheme that could not be applied to the map fails.

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input.")]
pub struct AuditMapArgs {
    /// A COLMAP model or project folder, a map of OpenSfM, OpenMVG, Meshroom, nerfstudio, Bundler or NVM, or a .ply, .csv,
    /// .xyz, .txt, .asc, .pts, .npy, .npz, .las, .pcd, .e57 or .splat file
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    #[command(flatten)]
    pub map: MapArgs,
    /// Run a small audit: random lines (olc) and paired lines (ppl) at inlier ratio 0.5, and lists by similarity if there are
    /// descriptors
    #[arg(long, conflicts_with_all = ["schemes", "inlier_ratios", "neighbors"], help_heading = "Attack")]
    pub quick: bool,
    /// Schemes to audit, separated by commas [default: all, see unlift schemes]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::scheme,
          help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    #[command(flatten)]
    pub solvers: SolverArgs,
    /// Where neighborhoods come from, repeatable: oracle (made from the map itself); what an attacker
    /// makes from the released map: descriptors (the best that they allow without training), similarity, overlap (SIFT),
    /// learned (a network; SIFT or ALIKED), geometric (no descriptors); or a file
    #[arg(long, value_name = "oracle|SOURCE|FILE", value_parser = values::neighbor_source,
          default_value = "oracle", help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    #[command(flatten)]
    pub attack: AttackArgs,
    /// Errors up to which a point counts as recovered, by commas; kept as typed
    /// [default: 0.10,0.25 with --scale, else 1.0,2.5]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold,
          help_heading = "Result")]
    pub thresholds: Vec<Threshold>,
    /// Paint the recovered points as the map's cameras see them, and compare with their photos: rows get ssim,
    /// psnr and lpips, and the report the pictures (of a COLMAP model with descriptors)
    #[arg(long, help_heading = "Result", requires = "photos")]
    pub invert: bool,
    /// Paint with this network in place of the one known for the descriptors: ONNX, as
    /// training/inversion exports it
    #[arg(long, value_name = "FILE", help_heading = "Result", requires = "invert")]
    pub inverter: Option<PathBuf>,
    /// Folder of the photos of the map
    #[arg(long, value_name = "DIR", help_heading = "Result", requires = "invert")]
    pub photos: Option<PathBuf>,
    /// Photos to compare with at most, evenly spaced over their names
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "12", help_heading = "Result")]
    pub max_photos: NonZeroUsize,
    /// Cut a large map into tiles of at most so many points and audit each as a map of its own: memory stays that of one tile, and the
    /// page shows which tiles leak most. Recommended beyond a few million points
    #[arg(long, value_parser = values::count, value_name = "N", help_heading = "Run",
          conflicts_with_all = ["invert", "write_clouds", "journal"])]
    pub tile_points: Option<NonZeroUsize>,
    /// Also write original, obfuscated and recovered clouds (PLY, OBJ)
    #[arg(long, help_heading = "Result", conflicts_with = "share_safe")]
    pub write_clouds: bool,
    /// Keep what was recovered in this folder until the audit is done, and go on from there if it was
    /// interrupted: the same options, the same figures. As private as the map
    #[arg(long, value_name = "DIR", help_heading = "Run")]
    pub journal: Option<PathBuf>,
    #[command(flatten)]
    pub result: ResultArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

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
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0, help_heading = "Input")]
    pub seed: u64,
    /// Schemes to audit, separated by commas [default: lines2d,cp2d,dcl2d]
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
    /// Paint the recovered keypoints and compare with the photos: rows get ssim, psnr and lpips, and the
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

/// Options of `audit released`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift audit released mine.parquet --truth truth.parquet --name mine
  unlift audit released mine.parquet --truth truth.parquet --neighbors oracle --neighbors geometric
  unlift audit released mine.parquet --truth truth.parquet --gate 'all@0.5:0.10<=20' --json

For schemes of your own: make the records with any program and write two Parquet files, of what an
attacker sees and of what is hidden where (docs/formats.md says how, with pyarrow). Every record must
be a line, a ray, an axis-parallel plane, or a point with one foreign coordinate.

Gates are those of unlift audit map, by the name of the scheme, or all.

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input.")]
pub struct AuditReleasedArgs {
    /// A released map
    #[arg(value_name = "RELEASED")]
    pub released: PathBuf,
    /// Its truth: the originals, and the slot that hides each
    #[arg(long, value_name = "TRUTH", help_heading = "Input")]
    pub truth: PathBuf,
    /// What the scheme is called [default: scheme in the metadata of RELEASED, else released]
    #[arg(long, value_name = "NAME", value_parser = values::scheme_name, help_heading = "Input")]
    pub name: Option<String>,
    /// Descriptors of the originals, where RELEASED has none: a .npy array with a row per original, or a file
    /// that begins with P3DESC01
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub descriptors: Option<PathBuf>,
    /// True neighbors per point
    #[arg(long, value_name = "K", default_value = "50", help_heading = "Input",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// The integer that the oracle and the attacker draw from
    #[arg(long, value_name = "INTEGER", default_value_t = 0, help_heading = "Input")]
    pub seed: u64,
    #[command(flatten)]
    pub solvers: SolverArgs,
    /// Where neighborhoods come from, repeatable: oracle (made from the truth); what an attacker makes
    /// from the released map: descriptors (the best that they allow without training), similarity, overlap (SIFT),
    /// learned (a network; SIFT or ALIKED), geometric (no descriptors); or a file of lists by original
    #[arg(long, value_name = "oracle|SOURCE|FILE", value_parser = values::neighbor_source,
          default_value = "oracle", help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    #[command(flatten)]
    pub attack: AttackArgs,
    /// Errors up to which a point counts as recovered, by commas; kept as typed
    /// [default: 0.10,0.25 in meters, else 1.0,2.5]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold,
          help_heading = "Result")]
    pub thresholds: Vec<Threshold>,
    /// Also write original, obfuscated and recovered clouds (PLY, OBJ)
    #[arg(long, help_heading = "Result", conflicts_with = "share_safe")]
    pub write_clouds: bool,
    #[command(flatten)]
    pub result: ResultArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `check`.
#[derive(Debug, Args)]
#[command(after_help = "\
A configuration has a table per audit, [[map]], [[images]] or [[released]], with a path and any long
options of unlift audit map, images or released (but --json); lists are arrays or text with commas.
Paths are relative to the configuration.

  [[map]]
  path = \"maps/office\"
  scale = 1
  schemes = [\"ppl\", \"ppl+\"]
  gate = [\"all@0.5:0.10<=20\"]
  out = \"audits/office\"
  junit = \"audits/office.xml\"
  share-safe = true

Every audit is run, whatever becomes of the others, and told in one line.

Examples:
  unlift check
  unlift check ci/unlift.toml --quiet

Exit codes: 0 done, 1 a gate failed, 2 usage, be it in the configuration, 3 bad input; of several
audits the largest.")]
pub struct CheckArgs {
    /// A configuration
    #[arg(value_name = "CONFIG", default_value = "unlift.toml")]
    pub config: PathBuf,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
