//! Positions as 16-bit numbers in base64, within a budget of bytes whatever the map's size.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::{ObfuscationView, Scene3d, SceneBox, Shapes, View, subsample};

/// Bytes of the page that the 3D view may take. With the libraries (about 1.1 MB), the tables and
/// the curves the page stays below 10 MB.
pub const SCENE_BUDGET_BYTES: usize = 6_000_000;

/// Shapes drawn per scheme: a screen is full of lines long before that.
const MAX_SHAPES: usize = 1_500;
/// Points drawn for a scheme that publishes points.
const MAX_SHAPE_POINTS: usize = 6_000;
const MAX_CAMERAS: usize = 5_000;

const BYTES_PER_POINT: usize = 3 * size_of::<u16>();
/// A recovered point: its position and one byte of error.
const BYTES_PER_RECOVERED: usize = BYTES_PER_POINT + 1;
const BYTES_PER_PATCH: usize = 4 * BYTES_PER_POINT;
/// Markup around one embedded block.
const BYTES_PER_BLOCK: usize = 200;

/// Positions are 0..=65534; this one is "not drawn": lost, not released, or outside the box.
const NOT_DRAWN: u16 = u16::MAX;
/// The byte of error of a point that is lost or not released.
const LOST: u8 = u8::MAX;
/// Errors are stored as `log10(error / first threshold)` from -3 to 3 in 0..=254.
const ERROR_DECADES: f32 = 3.0;

/// How many points may stand in the page for `n_views` views and `n_schemes` schemes.
///
/// More views mean fewer points each, so that the page stays within [`SCENE_BUDGET_BYTES`].
pub fn points_within_budget(n_views: usize, n_schemes: usize) -> usize {
    let shapes = (MAX_SHAPES * BYTES_PER_PATCH).max(MAX_SHAPE_POINTS * BYTES_PER_POINT);
    let blocks = (n_views + n_schemes + 2) * BYTES_PER_BLOCK;
    let fixed = n_schemes * shapes + MAX_CAMERAS * BYTES_PER_POINT;
    let budget = SCENE_BUDGET_BYTES.saturating_sub(blocks) / 4 * 3;
    budget.saturating_sub(fixed) / (BYTES_PER_POINT + n_views * BYTES_PER_RECOVERED)
}

/// The 3D view as the page's script reads it.
#[derive(Debug, serde::Serialize)]
pub(crate) struct Encoded {
    pub low: [f32; 3],
    pub high: [f32; 3],
    pub up: [f32; 3],
    pub n_points: u64,
    pub n_drawn: usize,
    pub n_cameras: usize,
    pub error_unit: f32,
    pub obfuscations: Vec<EncodedShapes>,
    pub views: Vec<EncodedView>,
    /// Base64 blocks; everything above refers to them by index.
    #[serde(skip)]
    pub blocks: Vec<String>,
}

#[derive(Debug, serde::Serialize)]
pub(crate) struct EncodedShapes {
    pub scheme: String,
    pub kind: &'static str,
    pub count: usize,
    pub block: usize,
}

#[derive(Debug, serde::Serialize)]
pub(crate) struct EncodedView {
    pub scheme: String,
    pub solver: String,
    pub inlier_ratio: f64,
    pub n_lost: usize,
    pub block: usize,
}

/// Encodes `scene`, thinned further if it breaks the budget; errors are told relative to
/// `error_unit`, the first threshold.
///
/// Block 0 holds the originals, block 1 the cameras.
pub(crate) fn encode(scene: &Scene3d, error_unit: f32) -> Encoded {
    let bounds = SceneBox::robust(&scene.originals);
    let max = points_within_budget(scene.views.len(), scene.obfuscations.len());
    let chosen = subsample(scene.originals.len(), max, 0);
    let mut blocks = Vec::new();
    let mut push = |bytes: Vec<u8>| {
        blocks.push(STANDARD.encode(bytes));
        blocks.len() - 1
    };

    let originals = chosen.iter().map(|&i| scene.originals[i]);
    push(positions(&bounds, originals));
    let cameras = subsample(scene.cameras.len(), MAX_CAMERAS, 0);
    push(positions(&bounds, cameras.iter().map(|&i| scene.cameras[i])));

    let mut obfuscations = Vec::new();
    for ObfuscationView { scheme, shapes } in &scene.obfuscations {
        let (kind, bytes, count) = encode_shapes(&bounds, shapes);
        let block = push(bytes);
        obfuscations.push(EncodedShapes { scheme: scheme.clone(), kind, count, block });
    }
    let mut views = Vec::new();
    for view in &scene.views {
        let (bytes, n_lost) = encode_view(&bounds, &scene.originals, view, &chosen, error_unit);
        let block = push(bytes);
        let View { scheme, solver, inlier_ratio, .. } = view.clone();
        views.push(EncodedView { scheme, solver, inlier_ratio, n_lost, block });
    }
    Encoded {
        low: bounds.low,
        high: bounds.high,
        up: scene.up.unwrap_or([0.0, 0.0, 1.0]),
        n_points: scene.n_points.max(scene.originals.len() as u64),
        n_drawn: chosen.len(),
        n_cameras: cameras.len(),
        error_unit,
        obfuscations,
        views,
        blocks,
    }
}

/// Positions of all points, then one byte of error each.
fn encode_view(
    bounds: &SceneBox,
    originals: &[[f32; 3]],
    view: &View,
    chosen: &[usize],
    error_unit: f32,
) -> (Vec<u8>, usize) {
    let recovered = |i: usize| view.recovered.get(i).copied().unwrap_or([f32::NAN; 3]);
    let mut bytes = positions(bounds, chosen.iter().map(|&i| recovered(i)));
    let mut n_lost = 0;
    for &i in chosen {
        let error = distance(recovered(i), originals[i]);
        if error.is_nan() {
            n_lost += 1;
        }
        bytes.push(error_byte(error / error_unit));
    }
    (bytes, n_lost)
}

fn encode_shapes(bounds: &SceneBox, shapes: &Shapes) -> (&'static str, Vec<u8>, usize) {
    let max = if matches!(shapes, Shapes::Points(_)) { MAX_SHAPE_POINTS } else { MAX_SHAPES };
    let chosen = subsample(shapes.len(), max, 0);
    let count = chosen.len();
    let chosen = chosen.into_iter();
    match shapes {
        Shapes::Segments(all) => {
            ("segments", positions(bounds, chosen.flat_map(|i| all[i])), count)
        }
        Shapes::Patches(all) => ("patches", positions(bounds, chosen.flat_map(|i| all[i])), count),
        Shapes::Points(all) => ("points", positions(bounds, chosen.map(|i| all[i])), count),
    }
}

/// Little-endian u16 triples, 0..=65534 across the box.
fn positions(bounds: &SceneBox, points: impl Iterator<Item = [f32; 3]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for point in points {
        for value in quantize(bounds, point) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

fn quantize(bounds: &SceneBox, point: [f32; 3]) -> [u16; 3] {
    let mut cells = [0; 3];
    for axis in 0..3 {
        let share = (point[axis] - bounds.low[axis]) / (bounds.high[axis] - bounds.low[axis]);
        // A hair of slack: ends of clipped lines lie on the box up to rounding.
        if !(-1e-4..=1.0001).contains(&share) {
            return [NOT_DRAWN; 3];
        }
        cells[axis] = (share.clamp(0.0, 1.0) * f32::from(NOT_DRAWN - 1)).round() as u16;
    }
    cells
}

fn error_byte(relative: f32) -> u8 {
    if relative.is_nan() {
        return LOST;
    }
    let share = (relative.max(1e-9).log10() / ERROR_DECADES).clamp(-1.0, 1.0) * 0.5 + 0.5;
    (share * f32::from(LOST - 1)).round() as u8
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f32>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(n: usize, n_views: usize) -> Scene3d {
        let originals: Vec<[f32; 3]> =
            (0..n).map(|i| [i as f32, (i * 7 % 13) as f32, 0.5]).collect();
        let view = View {
            scheme: "olc".into(),
            solver: "consensus".into(),
            inlier_ratio: 0.5,
            recovered: originals.clone(),
        };
        let patch = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let shapes = Shapes::Patches(vec![patch; n]);
        Scene3d {
            cameras: originals.clone(),
            n_points: n as u64,
            obfuscations: vec![ObfuscationView { scheme: "plane".into(), shapes }; 7],
            views: vec![view; n_views],
            up: None,
            originals,
        }
    }

    #[test]
    fn the_budget_holds_for_any_number_of_points_and_views() {
        for (n, n_views) in [(0, 0), (10, 1), (60_000, 7), (20_000, 84), (300, 5_000)] {
            let encoded = encode(&scene(n, n_views), 0.1);
            let bytes: usize =
                encoded.blocks.iter().map(|block| block.len() + BYTES_PER_BLOCK).sum();
            assert!(bytes <= SCENE_BUDGET_BYTES, "{n} points, {n_views} views: {bytes} bytes");
            assert_eq!(encoded.n_drawn, n.min(points_within_budget(n_views, 7)));
        }
        assert!(points_within_budget(42, 7) > 8_000, "a usual audit shows a real cloud");
        assert_eq!(points_within_budget(usize::MAX / 1_000, 7), 0);
    }

    #[test]
    fn a_position_survives_to_a_ten_thousandth_of_the_box() {
        let bounds = SceneBox { low: [-5.0, 0.0, 10.0], high: [5.0, 1.0, 30.0] };
        let cells = quantize(&bounds, [1.234, 0.5, 12.0]);
        for (axis, expected) in [1.234, 0.5, 12.0].into_iter().enumerate() {
            let side = bounds.high[axis] - bounds.low[axis];
            let found = bounds.low[axis] + f32::from(cells[axis]) / 65534.0 * side;
            assert!((found - expected).abs() < 1e-4 * side);
        }
        assert_eq!(quantize(&bounds, [f32::NAN; 3]), [NOT_DRAWN; 3]);
        assert_eq!(quantize(&bounds, [9.0, 0.5, 12.0]), [NOT_DRAWN; 3]);
    }

    #[test]
    fn errors_are_log_scaled_and_lost_points_stand_apart() {
        assert_eq!(error_byte(f32::NAN), LOST);
        assert_eq!(error_byte(1.0), 127);
        assert_eq!(error_byte(0.0), 0);
        assert_eq!(error_byte(f32::INFINITY), 254);
    }
}
