//! Arguments of the five audits. What several audits share is a struct of its own.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, value_parser};
use serde_json::{Map, Value, json};
use unlift::Unit;
use unlift::audit::Threshold;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{Entry, Mitigation, Protection};
use unlift::recover::Builtin;
use unlift_audit::Gate;
use unlift_audit::images::Wanted;
use unlift_vision::network::DescriptorKind;

use crate::values::{self, NeighborSource};

/// Options of every audit.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Result")]
pub struct AuditArgs {
    /// Largest errors at which a point counts as recovered, separated by commas [default: in meters
    /// 0.10,0.25; in pixels 1,5,10,25 or, for a sequence, 5,10,25; without a scale 1.0,2.5 multiples
    /// of the median distance to the K-th nearest neighbor]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold)]
    pub thresholds: Vec<Threshold>,
    /// Fail with exit code 1 if an attack recovers more than this; repeatable. Syntax: see Gates in unlift audit map --help
    #[arg(long, value_name = "GATE", value_parser = Gate::parse)]
    pub gate: Vec<Gate>,
    /// Also write the results of the gates as JUnit XML, for GitHub, GitLab, Jenkins and others
    #[arg(long, value_name = "FILE", requires = "gate")]
    pub junit: Option<PathBuf>,
    /// Folder for report.html and audit.json; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-audit")]
    pub out: PathBuf,
    /// Write only numbers, which you can show to others: no points, paths, names or hashes
    #[arg(long)]
    pub share_safe: bool,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
    /// Random seed; the second release of unlift audit again has the next one
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
}

/// Options of the oracle's lists, and of repeats.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Attack")]
pub struct OracleArgs {
    /// Inlier ratios of the oracle's lists (fractions of true nearest neighbors), separated by
    /// commas [default: 0.5,0.1; for images 1,0.75,0.5,0.3,0.2,0.1]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::ratio)]
    pub inlier_ratios: Vec<f64>,
    /// Wrong entries of the oracle's lists, separated by commas or repeated: uniform (random
    /// records), near (random records between the (2 x K)-th and the (10 x K)-th nearest),
    /// clustered (nearby points share the same few wrong places, as happens where descriptors look alike) [default: uniform]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::by(Noise::from_name))]
    pub oracle_noise: Vec<Noise>,
    /// Average the results over N random seeds
    #[arg(long, value_name = "N", default_value = "1", value_parser = value_parser!(u32).range(1..=10_000))]
    pub repeats: u32,
}

/// Sources and solvers of audits of maps.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Attack")]
pub struct SolverArgs {
    /// Source of the attacker's lists of neighbors; repeatable, FILE once. oracle, a test tool, makes lists
    /// from the original points, with a chosen fraction of true neighbors. The others make lists
    /// from the released map: descriptors (the best one for the descriptors), similarity (any
    /// descriptors), overlap (SIFT), learned (a network, for SIFT or ALIKED), geometric (places
    /// where many records meet; no descriptors). FILE has a list of neighbors per original point (docs/formats.md)
    /// [default: descriptors, if there are any, and oracle]
    #[arg(long, value_name = "oracle|SOURCE|FILE", value_parser = values::neighbor_source)]
    pub neighbors: Vec<NeighborSource>,
    /// Recovery methods, separated by commas or repeated. With lists of neighbors: joint (the
    /// strongest), consensus (each point from its own list), ransac (the attack of Chelani et al.
    /// 2025). Without lists, from the records alone (what a scheme releases in place of points):
    /// density (published attacks), tomography (stronger) [default: joint; also consensus if the map has fewer than 150 x K points]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::solver)]
    pub solver: Vec<Builtin>,
    /// Skip the baseline "records alone", the best attack that uses only the records, without
    /// descriptors; it may make lists from them. It often takes most of the time. Without the baseline, figures may be too low
    #[arg(long)]
    pub no_records_alone: bool,
}

/// Protection of descriptors.
#[derive(Debug, Args)]
#[command(next_help_heading = "Attack")]
pub struct ProtectArgs {
    /// Also audit every scheme with protected descriptors; repeatable. subspace:2 releases a plane
    /// through each descriptor (CVPR 2021), with half of its directions towards public descriptors;
    /// also subspace:4:random or :adversarial. ldp:256,2,8 releases 2 of 256 public words, which
    /// contain the nearest one with a probability for epsilon = 8 (ICCV 2023). Sources read what an attacker infers
    #[arg(long, value_name = "RULE", value_parser = values::by(Protection::parse))]
    pub protect_descriptors: Vec<Protection>,
    /// Folder of photos, or file of features, whose descriptors owner and attacker know: the
    /// database of adversarial directions, and the source of words. Never use those of the map
    /// itself [default: the two photos of unlift demo]
    #[arg(long, value_name = "PATH", requires = "protect_descriptors")]
    pub public_descriptors: Option<PathBuf>,
}

impl ProtectArgs {
    fn recorded(&self) -> [Recorded; 2] {
        let names = named(self.protect_descriptors.iter().map(Protection::name));
        let public = names.as_ref().map(|_| public_name(self.public_descriptors.as_deref()));
        [("protect_descriptors", json!(names)), ("public_descriptors", json!(public))]
    }
}

/// Returns the origin of public descriptors, for the report.
pub fn public_name(path: Option<&Path>) -> &'static str {
    if path.is_some() { "given" } else { "photos of the demo" }
}

/// Options of painted pictures.
#[derive(Debug, Args)]
#[command(next_help_heading = "Result")]
pub struct PaintArgs {
    /// Paint pictures from the recovered points, and compare them with the photos by SSIM, PSNR and
    /// LPIPS. For a map, needs --photos and a COLMAP model with descriptors. --invert=FILE paints
    /// with your own network (ONNX), as the scripts in the repository's folder training/inversion write it
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    pub invert: Option<Option<PathBuf>>,
    /// Folder of the photos, if PATH is a map or a file. unlift applies the EXIF orientation of the
    /// photos only if PATH states that its keypoints refer to upright photos, as the output of unlift features does without --as-stored
    #[arg(long, value_name = "DIR")]
    pub photos: Option<PathBuf>,
}

impl PaintArgs {
    /// Returns the user's network and photos, which must not be overwritten.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.invert.iter().flatten().chain(&self.photos)
    }
}

/// Which features are extracted from photos.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct ExtractionArgs {
    /// Features to extract from photos: sift, aliked, or superpoint, whose weights you supply (see unlift models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::by(DescriptorKind::from_name))]
    pub features: Option<DescriptorKind>,
    /// Number of features per photo. aliked and superpoint keep the N best. sift keeps whole
    /// scales, the coarsest first, and stops after the scale that exceeds N, so it may return more
    /// than N [default: sift 8192, aliked 2048, superpoint 4096]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_features: Option<NonZeroUsize>,
    /// Keep only keypoints whose score exceeds SCORE; not for sift [default: aliked 0.2, superpoint
    /// 0.005]
    #[arg(long, value_name = "SCORE", value_parser = values::score)]
    pub min_score: Option<f32>,
}

impl ExtractionArgs {
    /// Returns what is asked of the extraction.
    pub fn wanted(&self) -> Wanted {
        Wanted {
            option: "--features",
            kind: self.features,
            max_features: self.max_features,
            min_score: self.min_score,
            ..Wanted::default()
        }
    }

    fn recorded(&self) -> [Recorded; 3] {
        let features = self.features.map(DescriptorKind::name);
        [
            ("features", json!(features)),
            ("max_features", json!(self.max_features)),
            ("min_score", json!(self.min_score)),
        ]
    }
}

/// Input options that `audit map` and `obfuscate` share.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct MapArgs {
    /// Meters per unit of the map. Without it, lengths are multiples of the median distance from a
    /// point to its K-th nearest neighbor (see --k)
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// File with the descriptors of the points: the COLMAP database.db or hloc features.h5 from
    /// which the model was made, a .npy array with a row per point (for a COLMAP model, by
    /// ascending point id), or a file in unlift's format P3DESC01 (docs/formats.md). Without it,
    /// audit map uses those beside the model, and obfuscate none
    #[arg(long, value_name = "FILE")]
    pub descriptors: Option<PathBuf>,
    /// Use a random subset of at most N points
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Number of nearest neighbors of a point that count as true neighbors (K)
    #[arg(long, value_name = "K", default_value = "50", value_parser = value_parser!(u16).range(1..))]
    pub k: u16,
}

impl MapArgs {
    /// Returns the unit of lengths.
    pub fn unit(&self) -> Unit {
        if self.scale.is_some() { Unit::Meter } else { Unit::KthNeighbor }
    }
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/audit-map.txt").trim_end())]
pub struct AuditMapArgs {
    /// A COLMAP model or project folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply,
    /// .csv, .xyz, .txt, .asc, .pts, .npy, .npz or .splat file
    pub path: PathBuf,
    #[command(flatten)]
    pub map: MapArgs,
    /// Refuse a map whose longest side is not from LOW to HIGH meters, as with a wrong --scale
    #[arg(long, value_name = "LOW..HIGH", value_parser = values::extent, requires = "scale", help_heading = "Input")]
    pub expect_extent: Option<(f64, f64)>,
    /// Run a small audit: the schemes olc (a random line through each point) and ppl (one line
    /// through two points), with the oracle at inlier ratio 0.5 and, if there are descriptors, the source similarity
    #[arg(long, conflicts_with_all = ["schemes", "inlier_ratios", "neighbors"], help_heading = "Attack")]
    pub quick: bool,
    /// Run a large audit, as the paper's tables need it: the oracle at the inlier ratios
    /// 1,0.75,0.5,0.3,0.2,0.1, and the solvers joint, consensus and ransac
    #[arg(long, conflicts_with = "quick", help_heading = "Attack")]
    pub full: bool,
    /// Schemes to audit, separated by commas (unlift schemes lists them) [default: all]
    #[arg(long, alias = "scheme", value_name = "LIST", value_delimiter = ',', value_parser = values::scheme::<3>, help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    #[command(flatten)]
    pub solvers: SolverArgs,
    #[command(flatten)]
    pub oracle: OracleArgs,
    /// Also audit every scheme after these changes to the map; separate steps by commas, repeat for
    /// alternatives. thin:1/4 keeps a random quarter of the points, thin:tracks:1/4 those that most
    /// images observe; noise:0.1 adds Gaussian noise of this standard deviation to each value of
    /// unit-length descriptors; bits:2 rounds each value to 2 bits; pca:32 keeps 32 principal
    /// components; drop:0.5 withholds half of the descriptors
    #[arg(long, value_name = "STEPS", value_parser = values::by(Mitigation::parse), help_heading = "Attack")]
    pub mitigate: Vec<Mitigation>,
    #[command(flatten)]
    pub protect: ProtectArgs,
    /// Cut a large map into tiles of at most N points and audit each tile as a separate map. This
    /// needs the memory of one tile, and the report shows which tiles leak most. Recommended beyond a few million points
    #[arg(long, value_parser = values::count, value_name = "N", help_heading = "Attack", conflicts_with_all = ["invert", "localize"])]
    pub tile_points: Option<NonZeroUsize>,
    #[command(flatten)]
    pub paint: PaintArgs,
    /// With --invert: compare pictures with at most N photos, evenly spaced by name. The oracle's
    /// pictures are those at inlier ratio 0.5, unless --inlier-ratios or --full is given
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "3", help_heading = "Result")]
    pub max_images: NonZeroUsize,
    /// Also localize held-out images of the map. The folder has its photos (SIFT features are
    /// extracted), or the file their features (see unlift features --as-stored). The map is made
    /// without the held-out images, with new descriptors; their keypoints are matched with it by
    /// descriptors, and the pose is estimated from the matches. Needs a COLMAP model with tracks
    #[arg(long, value_name = "PHOTOS|FEATURES", help_heading = "Result")]
    pub localize: Option<PathBuf>,
    /// Hold out one image of N
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "10", help_heading = "Result", requires = "localize")]
    pub hold_out: NonZeroUsize,
    #[command(flatten)]
    pub audit: AuditArgs,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/audit-images.txt").trim_end())]
pub struct AuditImagesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    pub path: PathBuf,
    #[command(flatten)]
    pub extraction: ExtractionArgs,
    /// Use at most N images, evenly spaced by name
    #[arg(long, value_parser = values::count, value_name = "N", help_heading = "Input")]
    pub max_images: Option<NonZeroUsize>,
    /// Number of nearest neighbors of a keypoint that count as true neighbors (K)
    #[arg(long, value_name = "K", default_value = "20", help_heading = "Input", value_parser = value_parser!(u16).range(1..))]
    pub k: u16,
    /// Schemes to audit, separated by commas (unlift schemes lists them) [default: lines2d,cp2d,dcl2d]
    #[arg(long, alias = "scheme", value_name = "LIST", value_delimiter = ',', value_parser = values::scheme::<2>, help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    /// Source of the attacker's lists of neighbors; repeatable: oracle, descriptors, similarity,
    /// overlap or learned (see unlift audit map) [default: descriptors, if there are any, and oracle]
    #[arg(long, value_name = "oracle|SOURCE", value_parser = values::image_source, help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    /// Recovery methods, separated by commas or repeated: joint, consensus or ransac (see unlift audit map) [default: joint]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::image_solver, help_heading = "Attack")]
    pub solver: Vec<Builtin>,
    #[command(flatten)]
    pub oracle: OracleArgs,
    #[command(flatten)]
    pub protect: ProtectArgs,
    #[command(flatten)]
    pub paint: PaintArgs,
    #[command(flatten)]
    pub audit: AuditArgs,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/audit-sequence.txt").trim_end())]
pub struct AuditSequenceArgs {
    /// A COLMAP project or model with the poses of the images
    pub model: PathBuf,
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    pub path: PathBuf,
    #[command(flatten)]
    pub extraction: ExtractionArgs,
    /// Meters per unit of MODEL, for --poses
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale, help_heading = "Input")]
    pub scale: Option<f64>,
    /// Schemes to audit, separated by commas (unlift schemes lists them) [default: lines2d,cp2d,dcl2d]
    #[arg(long, alias = "scheme", value_name = "LIST", value_delimiter = ',', value_parser = values::scheme::<2>, help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    /// Numbers of queries that the attacker watches, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::queries,
          default_value = "2,3,5,10,20", help_heading = "Attack")]
    pub queries: Vec<usize>,
    /// Also combine the queries with lists of neighbors within each of them, which this source
    /// makes: descriptors, similarity, overlap or learned (see unlift audit map)
    #[arg(long, value_name = "SOURCE", value_parser = values::own_image_source, help_heading = "Attack")]
    pub neighbors: Option<Named>,
    /// Also audit every scheme after this change to the descriptors of each query: noise:DEVIATION
    /// or drop:SHARE (see unlift audit map); repeat for alternatives
    #[arg(long, value_name = "STEPS", value_parser = values::image_mitigation, help_heading = "Attack")]
    pub mitigate: Vec<Mitigation>,
    /// Add an error to each pose, as localization has it: CM centimeters in a random direction and
    /// a turn by DEG degrees [default: the poses of MODEL]
    #[arg(long, value_name = "perturbed:CM,DEG", value_parser = values::poses, help_heading = "Attack")]
    pub poses: Option<(f64, f64)>,
    #[command(flatten)]
    pub paint: PaintArgs,
    #[command(flatten)]
    pub audit: AuditArgs,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/audit-again.txt").trim_end())]
pub struct AuditAgainArgs {
    /// The map of the first release: any PATH of unlift audit map
    pub a: PathBuf,
    /// The map of the second release, in the same frame; A again, or a later version of it
    pub b: PathBuf,
    /// Meters per unit of both maps. Without it, lengths are multiples of the median distance from a
    /// point of A to its 50th nearest neighbor
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale, help_heading = "Input")]
    pub scale: Option<f64>,
    /// File with the descriptors of the points of A, as for unlift audit map; give the option again
    /// for those of B, if A and B are different paths
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub descriptors: Vec<PathBuf>,
    /// Schemes of both releases, separated by commas: olc hides both under olc, olc/cp the second
    /// one under cp [default: every scheme with itself]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::scheme_pair, help_heading = "Attack")]
    pub schemes: Vec<[&'static Entry; 2]>,
    /// Skip the baseline "records alone", the best attack on the first release only, without descriptors. It takes most of the time
    #[arg(long, help_heading = "Attack")]
    pub no_records_alone: bool,
    #[command(flatten)]
    pub audit: AuditArgs,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/audit-released.txt").trim_end())]
pub struct AuditReleasedArgs {
    /// A file with the records of your scheme: what an attacker sees
    pub released: PathBuf,
    /// A file with the original points and, for each, the record that hides it
    #[arg(long, value_name = "TRUTH", help_heading = "Input")]
    pub truth: PathBuf,
    /// Name of the scheme in the results [default: the value of "scheme" in RELEASED, otherwise "released"]
    #[arg(long, value_name = "NAME", value_parser = unlift_audit::released::check_name, help_heading = "Input")]
    pub name: Option<String>,
    /// Refuse a map whose longest side is not from LOW to HIGH meters, as with a wrong unit
    #[arg(long, value_name = "LOW..HIGH", value_parser = values::extent, help_heading = "Input")]
    pub expect_extent: Option<(f64, f64)>,
    /// Descriptors of the original points, if RELEASED has none: a .npy array with a row per point,
    /// or a file in unlift's format P3DESC01 (docs/formats.md)
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub descriptors: Option<PathBuf>,
    /// Number of nearest neighbors of a point that count as true neighbors (K)
    #[arg(long, value_name = "K", default_value = "50", help_heading = "Input", value_parser = value_parser!(u16).range(1..))]
    pub k: u16,
    /// Also audit these schemes of unlift on the same points, separated by commas
    #[arg(long, alias = "scheme", value_name = "LIST", value_delimiter = ',', value_parser = values::scheme::<3>, help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    #[command(flatten)]
    pub solvers: SolverArgs,
    #[command(flatten)]
    pub oracle: OracleArgs,
    #[command(flatten)]
    pub audit: AuditArgs,
}

/// Name and value of an option in the report; null if it was not given.
type Recorded = (&'static str, Value);

/// Returns the options that were given, for the report.
fn given(options: impl IntoIterator<Item = Recorded>) -> Map<String, Value> {
    let options = options.into_iter().filter(|(_, value)| !value.is_null());
    options.map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Returns names for the report, if there are any.
fn named(names: impl Iterator<Item = String>) -> Option<Vec<String>> {
    Some(names.collect::<Vec<_>>()).filter(|names| !names.is_empty())
}

impl AuditMapArgs {
    /// Returns true if the audit uses descriptors, which may lie beside the model.
    pub fn uses_descriptors(&self) -> bool {
        let needs = |source: &NeighborSource| matches!(source, NeighborSource::Own(named) if named.name() != "geometric");
        let neighbors = &self.solvers.neighbors;
        neighbors.is_empty()
            || neighbors.iter().any(needs)
            || self.paint.invert.is_some()
            || self.mitigate.iter().any(Mitigation::changes_descriptors)
            || !self.protect.protect_descriptors.is_empty()
    }

    /// Returns the options that change the points, for the report.
    pub fn record(&self) -> Map<String, Value> {
        let invert = self.paint.invert.as_ref().map(|_| true);
        let options = [
            ("max_points", json!(self.map.max_points)),
            ("mitigate", json!(named(self.mitigate.iter().map(Mitigation::name)))),
        ];
        given(options.into_iter().chain(self.protect.recorded()).chain([
            ("hold_out", json!(self.localize.as_ref().map(|_| self.hold_out))),
            ("invert", json!(invert)),
            ("max_images", json!(invert.map(|_| self.max_images))),
        ]))
    }
}

impl AuditImagesArgs {
    /// Returns the options that change the images, for the report.
    pub fn record(&self) -> Map<String, Value> {
        given(self.extraction.recorded().into_iter().chain(self.protect.recorded()).chain([
            ("max_images", json!(self.max_images)),
            ("invert", json!(self.paint.invert.as_ref().map(|_| true))),
        ]))
    }
}

impl AuditSequenceArgs {
    /// Returns the options that change the images, for the report.
    pub fn record(&self) -> Map<String, Value> {
        let mitigate = named(self.mitigate.iter().map(Mitigation::name));
        let model = json!(self.model.display().to_string());
        let options = [("model", model), ("mitigate", json!(mitigate))];
        given(options.into_iter().chain(self.extraction.recorded()))
    }
}
