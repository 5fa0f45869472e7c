//! The data of the page's 3D view: originals, obfuscations and recovered points.
//!
//! All positions are in the document's unit (meters, or usual distances to the K-th neighbor), relative to an origin
//! near the map: large coordinates (10^6) must be centered before they become `f32`.

use serde_json::{Value, json};

use crate::attack::{self, ByAttack};
use crate::document::Row;
use crate::page::blocks::{Blocks, NOT_DRAWN, coordinate};
use crate::words;

/// The whole 3D view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene3d {
    /// Originals `(n, 3)` after thinning, see [`subsample`] and [`points_within_budget`].
    pub originals: Vec<[f32; 3]>,
    /// Number of originals before thinning.
    pub n_points: u64,
    /// Centers of the cameras `(m, 3)`; may be empty.
    pub cameras: Vec<[f32; 3]>,
    /// The up direction; `None` is +z.
    pub up: Option<[f32; 3]>,
    /// Released records, at most one entry per scheme.
    pub obfuscations: Vec<ObfuscationView>,
    /// Recovered points, at most one entry per row of the results.
    pub views: Vec<View>,
}

/// Recovered positions `(n, 3)`, aligned with [`Scene3d::originals`]; NaN if a point is lost or was not released.
pub type View = ByAttack<Vec<[f32; 3]>>;

/// Released records of one scheme; a sample is enough for the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct ObfuscationView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The records as drawn.
    pub shapes: Shapes,
    /// Number of records, drawn or not.
    pub n_records: u64,
    /// Indices in [`Scene3d::originals`] of points that the scheme did not release.
    pub withheld: Vec<usize>,
}

/// Records as drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Shapes {
    /// Lines and rays clipped to the scene.
    Segments(Vec<[[f32; 3]; 2]>),
    /// Planes as outlined rectangles, see [`SceneBox::axis_patch`].
    Patches(Vec<[[f32; 3]; 4]>),
    /// Published points (with one swapped coordinate, for `cp`).
    Points(Vec<[f32; 3]>),
}

/// Maximal number of bytes of the 3D view. With the libraries (about 1.1 MB), tables and curves the page stays below 10 MB.
pub const SCENE_BUDGET_BYTES: usize = 6_000_000;

/// Maximal number of lines or planes drawn per scheme.
const MAX_SHAPES: usize = 1_500;
/// Maximal number of points drawn for a scheme that publishes points.
const MAX_SHAPE_POINTS: usize = 6_000;
const MAX_CAMERAS: usize = 5_000;

const BYTES_PER_POINT: usize = 3 * size_of::<u16>();
const BYTES_PER_RECOVERED: usize = BYTES_PER_POINT + 1;
const BYTES_PER_PATCH: usize = 4 * BYTES_PER_POINT;
const BYTES_PER_BLOCK: usize = 200;

/// The error byte of a point that is lost or not released.
const LOST: u8 = u8::MAX;
/// Errors are stored as `log10(error / first threshold)`, from -3 to 3, in 0..=254.
const ERROR_DECADES: f32 = 3.0;

/// Returns the maximal number of points for `n_views` views and `n_schemes` schemes within [`SCENE_BUDGET_BYTES`].
pub fn points_within_budget(n_views: usize, n_schemes: usize) -> usize {
    let shapes = (MAX_SHAPES * BYTES_PER_PATCH).max(MAX_SHAPE_POINTS * BYTES_PER_POINT);
    let blocks = (n_views + n_schemes + 2) * BYTES_PER_BLOCK;
    let fixed = n_schemes * shapes + MAX_CAMERAS * BYTES_PER_POINT;
    let budget = SCENE_BUDGET_BYTES.saturating_sub(blocks) / 4 * 3;
    budget.saturating_sub(fixed) / (BYTES_PER_POINT + n_views * BYTES_PER_RECOVERED)
}

/// Returns the camera in the box that is farthest from the middle of the points, because it sees most of the scene.
fn eye(bounds: &SceneBox, cameras: &[[f32; 3]]) -> Option<[f32; 3]> {
    let far = |at: &[f32; 3]| (0..3).map(|c| (at[c] - bounds.middle[c]).powi(2)).sum::<f32>();
    let within = cameras.iter().filter(|&&camera| is_drawn(bounds, camera));
    within.copied().max_by(|a, b| far(a).total_cmp(&far(b)))
}

/// Returns the data of the script, whose blocks are added to `blocks`: first the originals, then the cameras. `None` if no point
/// or no recovered point would be drawn.
///
/// Points are thinned further if they exceed the budget. Errors are relative to `error_unit`, the first threshold. Views without
/// a row in `rows` and further views of one row are left out.
pub(crate) fn encode(
    scene: &Scene3d,
    rows: &[Row],
    error_unit: f32,
    blocks: &mut Blocks,
) -> Option<Value> {
    let mut shown: Vec<(usize, &View)> = Vec::new();
    for view in &scene.views {
        let row = rows.iter().position(|row| attack::is_same(&view.row, row));
        let is_new = |row: &usize| shown.iter().all(|(known, _)| known != row);
        shown.extend(row.filter(is_new).map(|row| (row, view)));
    }
    let max = points_within_budget(scene.views.len(), scene.obfuscations.len());
    let chosen = subsample(scene.originals.len(), max, 0);
    if chosen.is_empty() || shown.is_empty() {
        return None;
    }
    let bounds = SceneBox::robust(&scene.originals);
    let originals = chosen.iter().map(|&i| scene.originals[i]);
    blocks.push(positions(&bounds, originals.clone()));
    let visible = originals.filter(|&point| is_drawn(&bounds, point)).count();
    let cameras = subsample(scene.cameras.len(), MAX_CAMERAS, 0);
    blocks.push(positions(&bounds, cameras.iter().map(|&i| scene.cameras[i])));

    let obfuscations = scene.obfuscations.iter().map(|of| obfuscation(&bounds, of, blocks));
    let obfuscations: Vec<Value> = obfuscations.collect();
    let views = shown.into_iter().map(|(row, view)| {
        let (bytes, fate) = encode_view(&bounds, scene, view, &chosen, error_unit);
        let block = blocks.push(bytes);
        json!({ "row": row, "block": block, "drawn": fate.visible, "said": fate.in_words() })
    });
    let views: Vec<Value> = views.collect();
    let outside = chosen.len() - visible;
    Some(json!({
        "low": bounds.low,
        "high": bounds.high,
        "middle": bounds.middle,
        "up": scene.up.unwrap_or([0.0, 0.0, 1.0]),
        "n_points": scene.n_points.max(scene.originals.len() as u64),
        "n_drawn": chosen.len(),
        "originals_said": Fate { visible, outside, ..Fate::default() }.in_words(),
        "n_cameras": cameras.len(),
        // The first viewpoint: a camera of the map.
        "eye": eye(&bounds, &scene.cameras),
        "error_unit": error_unit,
        "obfuscations": obfuscations,
        "views": views,
    }))
}

/// Returns the data of one scheme's records, whose positions become a block.
fn obfuscation(bounds: &SceneBox, of: &ObfuscationView, blocks: &mut Blocks) -> Value {
    // The corners of all shapes, and how many each has.
    let (kind, name, corners, each, max) = match &of.shapes {
        Shapes::Segments(all) => ("segments", "lines", all.as_flattened(), 2, MAX_SHAPES),
        Shapes::Patches(all) => ("patches", "planes", all.as_flattened(), 4, MAX_SHAPES),
        Shapes::Points(all) => ("points", "points", &all[..], 1, MAX_SHAPE_POINTS),
    };
    let chosen = subsample(corners.len() / each, max, 0);
    let corners = chosen.iter().flat_map(|&i| &corners[i * each..(i + 1) * each]);
    let block = blocks.push(positions(bounds, corners.copied()));
    let [some, all] = [chosen.len() as u64, of.n_records].map(words::thousands);
    // "1,500 of 3,895 lines drawn".
    let text = match chosen.len() as u64 >= of.n_records {
        true => format!("{some} {name} drawn"),
        false => format!("{some} of {all} {name} drawn"),
    };
    json!({ "scheme": of.scheme, "kind": kind, "count": chosen.len(), "block": block, "said": text })
}

fn encode_view(
    bounds: &SceneBox,
    scene: &Scene3d,
    view: &View,
    chosen: &[usize],
    error_unit: f32,
) -> (Vec<u8>, Fate) {
    let released = scene.obfuscations.iter().find(|of| of.scheme == view.row.scheme);
    let is_withheld = |i| released.is_some_and(|released| released.withheld.contains(&i));
    let recovered = |i: usize| view.recovered.get(i).copied().unwrap_or([f32::NAN; 3]);
    let mut bytes = positions(bounds, chosen.iter().map(|&i| recovered(i)));
    let mut fate = Fate::default();
    for &i in chosen {
        let away = recovered(i).into_iter().zip(scene.originals[i]).map(|(x, y)| (x - y) * (x - y));
        let error = away.sum::<f32>().sqrt();
        match () {
            () if is_drawn(bounds, recovered(i)) => fate.visible += 1,
            () if !error.is_nan() => fate.outside += 1,
            () if is_withheld(i) => fate.withheld += 1,
            () => fate.lost += 1,
        }
        bytes.push(error_byte(error / error_unit));
    }
    (bytes, fate)
}

fn is_drawn(bounds: &SceneBox, point: [f32; 3]) -> bool {
    quantize(bounds, point) != [NOT_DRAWN; 3]
}

/// Encodes positions as little-endian u16 triples, 0..=65534 across the box.
fn positions(bounds: &SceneBox, points: impl Iterator<Item = [f32; 3]>) -> Vec<u8> {
    points.flat_map(|point| quantize(bounds, point)).flat_map(u16::to_le_bytes).collect()
}

fn quantize(bounds: &SceneBox, point: [f32; 3]) -> [u16; 3] {
    let SceneBox { low, high, .. } = bounds;
    let shares = [0, 1, 2].map(|c| (point[c] - low[c]) / (high[c] - low[c]));
    // Ends of clipped lines lie on the box only up to rounding.
    match shares.iter().all(|share| (-1e-4..=1.0001).contains(share)) {
        true => shares.map(coordinate),
        false => [NOT_DRAWN; 3],
    }
}

fn error_byte(relative: f32) -> u8 {
    if relative.is_nan() {
        return LOST;
    }
    let share = (relative.max(1e-9).log10() / ERROR_DECADES).clamp(-1.0, 1.0) * 0.5 + 0.5;
    (share * f32::from(LOST - 1)).round() as u8
}

/// Counts of the points of one pane; each point is counted once.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Fate {
    visible: usize,
    withheld: usize,
    lost: usize,
    outside: usize,
}

impl Fate {
    /// Returns a sentence: "3,861 of 3,895 points drawn; 34 not released".
    fn in_words(&self) -> String {
        let missing =
            [(self.withheld, "not released"), (self.lost, "lost"), (self.outside, "far outside")];
        let missing = missing.into_iter().filter(|(n, _)| *n > 0);
        let missing: Vec<String> =
            missing.map(|(n, what)| format!("{} {what}", words::thousands(n))).collect();
        let all = words::thousands(self.visible + self.withheld + self.lost + self.outside);
        let drawn = match self.visible {
            _ if missing.is_empty() => return format!("{all} points drawn"),
            0 => "None".to_owned(),
            n => words::thousands(n),
        };
        format!("{drawn} of {all} points drawn; {}", missing.join(", "))
    }
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneBox {
    /// Smallest corner.
    pub low: [f32; 3],
    /// Largest corner.
    pub high: [f32; 3],
    /// The median of each coordinate.
    pub middle: [f32; 3],
}

impl SceneBox {
    /// Returns the box from the 1st to the 99th percentile of each coordinate, widened by a tenth
    /// of its longest side. Percentiles exclude far outliers, which would shrink the scene to a dot.
    ///
    /// Ignores non-finite coordinates; without points it starts from the unit cube about the origin.
    pub fn robust(points: &[[f32; 3]]) -> Self {
        let sides = [0, 1, 2].map(|axis| {
            let mut values: Vec<f32> =
                points.iter().map(|p| p[axis]).filter(|x| x.is_finite()).collect();
            values.sort_unstable_by(f32::total_cmp);
            let Some(last) = values.len().checked_sub(1) else { return [-0.5, 0.0, 0.5] };
            [last / 100, last / 2, last - last / 100].map(|at| values[at])
        });
        let longest = sides.iter().map(|[low, _, high]| high - low).fold(0.0, f32::max);
        let margin = if longest > 0.0 { 0.1 * longest } else { 0.5 };
        Self {
            low: sides.map(|[low, ..]| low - margin),
            high: sides.map(|[.., high]| high + margin),
            middle: sides.map(|[_, middle, _]| middle),
        }
    }

    /// Returns the rectangle of the plane `coordinate[axis] == offset` in the box; `None` if it is outside.
    pub fn axis_patch(&self, axis: usize, offset: f32) -> Option<[[f32; 3]; 4]> {
        if !(self.low[axis]..=self.high[axis]).contains(&offset) {
            return None;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let Self { low, high, .. } = self;
        Some([(low, low), (high, low), (high, high), (low, high)].map(|(first, second)| {
            let mut point = [offset; 3];
            point[u] = first[u];
            point[v] = second[v];
            point
        }))
    }
}

/// Returns at most `max` of the indices `0..n`, ascending, chosen by a hash of the index and
/// `seed`. The choice is equal on every machine and independent of the order of a map file.
pub fn subsample(n: usize, max: usize, seed: u64) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..n).collect();
    if n > max {
        indices.select_nth_unstable_by_key(max, |&i| (mix(seed, i as u64), i));
        indices.truncate(max);
        indices.sort_unstable();
    }
    indices
}

fn mix(seed: u64, counter: u64) -> u64 {
    let mut z = seed.wrapping_add(counter.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(n: usize, n_views: usize) -> Scene3d {
        let originals: Vec<[f32; 3]> =
            (0..n).map(|i| [i as f32, (i * 7 % 13) as f32, 0.5]).collect();
        let patch = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let plane = ObfuscationView {
            scheme: "plane".into(),
            shapes: Shapes::Patches(vec![patch; n]),
            n_records: n as u64,
            withheld: Vec::new(),
        };
        let views = (0..n_views).map(|at| View { row: row(at), recovered: originals.clone() });
        Scene3d {
            cameras: originals.clone(),
            n_points: n as u64,
            obfuscations: vec![plane; 7],
            views: views.collect(),
            up: None,
            originals,
        }
    }

    fn row(at: usize) -> Row {
        let neighbors = format!("source-{at}");
        Row { scheme: "olc".into(), neighbors, solver: "consensus".into(), ..Row::default() }
    }

    #[test]
    fn the_budget_holds_for_any_number_of_points_and_views() {
        for (n, n_views) in [(0, 1), (10, 0), (10, 1), (60_000, 7), (20_000, 84), (300, 3_000)] {
            let rows: Vec<Row> = (0..n_views).map(row).collect();
            let mut blocks = Blocks::default();
            let data = encode(&scene(n, n_views), &rows, 0.1, &mut blocks);
            let bytes: usize = blocks.0.iter().map(|block| block.len() + BYTES_PER_BLOCK).sum();
            assert!(bytes <= SCENE_BUDGET_BYTES, "{n} points, {n_views} views: {bytes} bytes");
            assert_eq!(data.is_some(), n > 0 && n_views > 0);
            let Some(data) = data else { continue };
            assert_eq!(data["views"].as_array().map(Vec::len), Some(n_views));
            assert_eq!(data["n_drawn"], n.min(points_within_budget(n_views, 7)));
        }
        assert!(points_within_budget(42, 7) > 8_000, "a usual audit shows a real cloud");
        assert_eq!(points_within_budget(usize::MAX / 1_000, 7), 0);
    }

    #[test]
    fn every_point_is_counted_once() {
        let mut scene = scene(9, 1);
        scene.obfuscations[0].scheme = "olc".into();
        scene.obfuscations[0].withheld = vec![3];
        scene.views[0].recovered[3] = [f32::NAN; 3];
        scene.views[0].recovered[4] = [f32::NAN; 3];
        scene.views[0].recovered[5] = [1e6; 3];
        let data = encode(&scene, &[row(0)], 0.1, &mut Blocks::default()).expect("a view");
        let view = &data["views"][0];
        assert_eq!(view["drawn"], 6);
        assert_eq!(view["said"], "6 of 9 points drawn; 1 not released, 1 lost, 1 far outside");
    }

    #[test]
    fn outliers_do_not_stretch_the_box() {
        let mut points: Vec<[f32; 3]> = (0..1000).map(|i| [i as f32 / 1000.0; 3]).collect();
        points.push([1e6, -1e6, f32::NAN]);
        let scene = SceneBox::robust(&points);
        assert!(scene.low.iter().all(|&x| (-0.2..0.0).contains(&x)), "{scene:?}");
        assert!(scene.high.iter().all(|&x| (1.0..1.2).contains(&x)), "{scene:?}");
    }
}
