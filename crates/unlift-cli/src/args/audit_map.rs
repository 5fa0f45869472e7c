//! Arguments of `unlift audit map`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift::obfuscate::Entry;

use super::audit::{AttackArgs, ResultArgs, RunArgs, SolverArgs};
use super::map::MapArgs;
use crate::values::{self, NeighborSource};

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
    /// A first look: random lines (olc) and paired lines (ppl) at half of the neighbors right, and lists by similarity
    /// where there are descriptors
    #[arg(long, conflicts_with_all = ["schemes", "inlier_ratios", "neighbors"], help_heading = "Attack")]
    pub quick: bool,
    /// Schemes to audit, by commas [default: all, see unlift schemes]
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
    /// Paint what came back as the map's cameras see it, and compare with their photos: rows get ssim,
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
