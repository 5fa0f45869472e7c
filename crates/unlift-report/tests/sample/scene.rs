//! The synthetic room in three dimensions, and its recovered points.

use unlift_report::Given;
use unlift_report::document::Document;
use unlift_report::scene::{ObfuscationView, Scene3d, SceneBox, Shapes, View};

use super::{SCHEMES, unit_random};

/// Returns a room of 6 x 4.5 x 2.6 with a table, a shelf and two boxes.
fn room(n: usize) -> Vec<[f32; 3]> {
    let boxes: [([f32; 3], [f32; 3]); 8] = [
        ([0.0, 0.0, 0.0], [6.0, 4.5, 2.6]),
        ([2.0, 1.4, 0.70], [3.9, 2.6, 0.75]),
        ([2.1, 1.5, 0.0], [2.2, 1.6, 0.7]),
        ([3.7, 2.4, 0.0], [3.8, 2.5, 0.7]),
        ([0.1, 0.2, 0.0], [0.5, 1.9, 2.0]),
        ([5.2, 3.4, 0.0], [5.9, 4.3, 0.9]),
        ([2.6, 1.7, 0.75], [2.9, 2.0, 1.1]),
        ([4.6, 0.1, 0.0], [5.6, 0.5, 1.4]),
    ];
    let point = |i: usize| {
        let at = |lane: u64| unit_random(8 * i as u64 + lane);
        // Furniture is denser than walls.
        let which = if at(0) < 0.45 { 0 } else { 1 + (at(1) * 6.999) as usize };
        let (low, high) = boxes[which];
        let axis = (at(2) * 2.999) as usize;
        let mut p: [f32; 3] =
            std::array::from_fn(|a| low[a] + at(3 + a as u64) * (high[a] - low[a]));
        p[axis] = if at(6) < 0.5 { low[axis] } else { high[axis] };
        p.map(|x| x + 0.012 * (at(7) - 0.5))
    };
    (0..n).map(point).collect()
}

/// Returns points of the room and their recovered positions, consistent with the figures of
/// `document`.
pub fn scene(document: &Document, n: usize) -> Scene3d {
    let originals = room(n);
    let bounds = SceneBox::robust(&originals);
    let direction = |i: usize| -> [f32; 3] {
        std::array::from_fn(|a| unit_random(900_000 + 3 * i as u64 + a as u64) - 0.5)
    };
    let center = [3.0, 2.2, 1.3];
    let obfuscations = SCHEMES.map(|scheme| {
        let indices = 0..1_500.min(n);
        let shapes = match scheme {
            "plane" => Shapes::Patches(
                indices
                    .step_by(10)
                    .filter_map(|i| bounds.axis_patch(i / 10 % 3, originals[i][i / 10 % 3]))
                    .collect(),
            ),
            "cp" => Shapes::Points(
                originals
                    .iter()
                    .enumerate()
                    .map(|(i, p)| {
                        let mut q = *p;
                        q[i % 3] = originals[(i * 7 + 1) % n][i % 3];
                        q
                    })
                    .collect(),
            ),
            "ray" | "ray-voxel" => Shapes::Segments(
                indices
                    .filter_map(|i| {
                        let d = std::array::from_fn(|a| originals[i][a] - center[a]);
                        bounds.clip_ray(center, d)
                    })
                    .collect(),
            ),
            _ => Shapes::Segments(
                indices.filter_map(|i| bounds.clip_line(originals[i], direction(i))).collect(),
            ),
        };
        // One scheme does not release every hundredth point.
        let withheld = (0..if scheme == "ppl+" { n } else { 0 }).step_by(100).collect();
        ObfuscationView { scheme: scheme.into(), shapes, n_records: n as u64, withheld }
    });
    let views = document.results.iter().enumerate().map(|(r, row)| {
        let share = row.recovered_percent[0] as f32 / 100.0;
        let recovered = originals.iter().enumerate().map(|(i, p)| {
            let chance = |lane: u64| unit_random(77 + 16 * (i as u64 + n as u64 * r as u64) + lane);
            if chance(0) < row.n_lost as f32 / row.n_points as f32 {
                return [f32::NAN; 3];
            }
            let size =
                if chance(1) < share { 0.05 * chance(2) } else { 0.15 + 4.0 * chance(2).powi(3) };
            std::array::from_fn(|a| p[a] + size * (chance(3 + a as u64) - 0.5))
        });
        View {
            scheme: row.scheme.clone(),
            given: Given::of(row),
            solver: row.solver.clone(),
            recovered: recovered.collect(),
        }
    });
    let views = views.collect();
    let cameras = (0..40).map(|i| {
        let angle = i as f32 * 0.157;
        [3.0 + 1.6 * angle.cos(), 2.2 + 1.1 * angle.sin(), 1.5]
    });
    Scene3d {
        n_points: document.input.n_points,
        cameras: cameras.collect(),
        up: None,
        obfuscations: obfuscations.into(),
        views,
        originals,
    }
}
