//! `--write-clouds`: original, hidden and recovered points for point cloud viewers.

use std::path::{Path, PathBuf};

use unlift::audit::Cell;
use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};
use unlift_io::Error;
use unlift_io::atomic::{Kind, OutputSet};
use unlift_io::clouds::{record_segments, write_lines, write_points, write_recovered};

/// Writes clouds in map units, so that they align with the owner's map.
pub struct Clouds {
    unit_in_map_units: f64,
    schemes: Vec<String>,
}

impl Clouds {
    /// Creates a writer that has written no clouds.
    pub fn new(unit_in_map_units: f64) -> Self {
        Self { unit_in_map_units, schemes: Vec::new() }
    }

    /// Writes the clouds of one result to the folder [`FOLDER`] of `out`. `full_scale` is the error
    /// at the end of the color ramp.
    pub fn write(
        &mut self,
        out: &mut OutputSet,
        cell: &Cell<'_>,
        full_scale: f64,
    ) -> Result<(), Error> {
        let scale = self.unit_in_map_units;
        let in_map = |p: &[f64; 3]| p.map(|x| x * scale);
        let originals: Vec<[f64; 3]> =
            cell.original.reveal().positions().iter().map(in_map).collect();
        if self.schemes.is_empty() {
            write_points(&stage(out, "original.ply")?, &originals)?;
        }
        let scheme = &cell.row.scheme;
        if !self.schemes.contains(scheme) {
            self.schemes.push(scheme.clone());
            self.write_obfuscated(out, scheme, cell.released, cell.original.reveal().positions())?;
        }
        let row = cell.row;
        // A measured ratio is not part of the name: two sources may have the same one.
        let given = match row.oracle_noise {
            None => row.neighbors.clone(),
            Some("uniform") => row.inlier_ratio.to_string(),
            Some(noise) => format!("{}-{noise}", row.inlier_ratio),
        };
        let name = format!("{scheme}-recovered-{given}-{}.ply", row.solver);
        let points: Vec<Option<[f64; 3]>> = (0..cell.recovered.n_slots())
            .map(|slot| cell.recovered.position(slot).map(|p| in_map(&p)))
            .collect();
        let errors: Vec<f64> = cell.accuracy.errors().iter().map(|e| e * scale).collect();
        write_recovered(&stage(out, &name)?, &points, &errors, full_scale * scale)
    }

    /// Writes lines and rays, clipped to the 1-99 % box, as OBJ, and published points as PLY.
    /// Planes have no finite shape and are omitted.
    fn write_obfuscated(
        &self,
        out: &mut OutputSet,
        scheme: &str,
        released: &Released<3>,
        originals: &[[f64; 3]],
    ) -> Result<(), Error> {
        let scale = self.unit_in_map_units;
        match released.obfuscation() {
            Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                let Some(bounds) = Bounds::quantiles(originals, 0.01) else { return Ok(()) };
                let mut segments = record_segments(released, &bounds.low, &bounds.high);
                for end in segments.iter_mut().flatten() {
                    *end = end.map(|x| x * scale);
                }
                write_lines(&stage(out, &format!("{scheme}-obfuscated.obj"))?, &segments)
            }
            Obfuscation::AxisCandidates(candidates) => {
                let origin = released.origin();
                let place = |p: &[f32; 3]| -> [f64; 3] {
                    std::array::from_fn(|c| (f64::from(p[c]) + origin[c]) * scale)
                };
                let points: Vec<[f64; 3]> = candidates.position().iter().map(place).collect();
                write_points(&stage(out, &format!("{scheme}-obfuscated.ply"))?, &points)
            }
            Obfuscation::AxisPlanes(_) => Ok(()),
        }
    }
}

/// The folder of clouds in the folder of an audit.
pub const FOLDER: &str = "clouds";

/// Lists the clouds of an earlier audit in the folder `out`, as relative paths. A new audit may
/// replace them.
pub fn earlier(out: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(out.join(FOLDER)) else { return Vec::new() };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let is_ours = |name: &String| {
        name == "original.ply" || name.contains("-recovered-") || name.contains("-obfuscated.")
    };
    names.filter(is_ours).map(|name| format!("{FOLDER}/{name}")).collect()
}

fn stage(out: &mut OutputSet, name: &str) -> Result<PathBuf, Error> {
    out.stage(&format!("{FOLDER}/{name}"), Kind::Cloud)
}
