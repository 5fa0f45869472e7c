//! Reads positions of a map from a NumPy archive.

use std::path::Path;

use super::archive::Archive;
use super::lines::quoted;
use super::npy::{Header, Layout, PLACES, of_points};
use crate::error::Error;
use crate::read::map_input::Input;
use crate::stage;

/// Reads positions from the array of points in a NumPy archive. Several or none are an error.
pub fn positions(path: &Path) -> Result<Input, Error> {
    let mut archive = Archive::open(path)?;
    let all = archive.arrays();
    if all.iter().any(|(_, name)| name.rsplit('/').next() == Some("unlift")) {
        let kind = stage::declared_kind(path).map(|kind| kind.to_string());
        let found = kind.unwrap_or_else(|| "a stage file of unlift".to_owned());
        return Err(Error::new(path, "", "points of a map", found));
    }
    let (mut fit, mut has_points) = (Vec::new(), false);
    for (at, name) in &all {
        let header = archive.array(*at, name).and_then(|mut bytes| Header::read(&mut bytes));
        if let Some((_, layout)) = header.ok().and_then(|header| header.points()) {
            fit.push((*at, &**name));
            has_points |= !matches!(layout, Layout::Matrix { columns: 4.. });
        }
    }
    let has = |start: &str| all.iter().any(|(_, name)| name.starts_with(start));
    // Some programs store position, size and angle of keypoints in one array, beside descriptors.
    let beside_descriptors = has("descriptors") && !has_points;
    if has("keypoints") || has("OPENSFM_FEATURES") || beside_descriptors {
        return Err(Error::new(path, "", "points of a map", "features of an image"));
    }
    let is_known = |name: &str| PLACES.iter().any(|known| name.eq_ignore_ascii_case(known));
    if fit.iter().filter(|(_, name)| is_known(name)).count() == 1 {
        fit.retain(|(_, name)| is_known(name));
    }
    let [(at, name)] = fit[..] else {
        if fit.is_empty() {
            fit = all.iter().map(|(at, name)| (*at, &**name)).collect();
        }
        let names: Vec<String> =
            fit.iter().take(5).map(|(_, name)| quoted(name.as_bytes())).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let expected = "one array of points, (n, 3), or one that is called points or xyz";
        return Err(Error::new(path, "", expected, found));
    };
    let mut input = of_points(&mut archive.array(at, name)?, "npz")?;
    if all.len() > 1 {
        input.notes.push(format!("read, the array {} of {}", quoted(name.as_bytes()), all.len()));
    }
    Ok(input)
}
