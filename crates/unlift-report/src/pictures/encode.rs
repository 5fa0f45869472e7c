//! Pictures as 16-bit numbers in base64, within a budget of bytes.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::{GRAPH_NEIGHBORS, Given, MOST_PICTURES, Marks, Picture};
use crate::scene::subsample;
use crate::words;

/// Bytes of the page that all pictures may take beside their photos, before base64.
const BUDGET_BYTES: usize = 3_600_000;
/// Positions are 0..=65534 across the image; this one is "not drawn".
const NOT_DRAWN: u16 = u16::MAX;
const BYTES_PER_POINT: usize = 2 * size_of::<u16>();

/// A picture as the page's script reads it; blocks by their number on the page.
#[derive(Debug, serde::Serialize)]
pub(crate) struct EncodedPicture {
    name: String,
    note: String,
    size: [u32; 2],
    photo: Option<usize>,
    n_keypoints: usize,
    n_drawn: usize,
    keypoints: usize,
    released: Vec<EncodedMarks>,
    views: Vec<EncodedView>,
    graphs: Vec<EncodedGraph>,
}

#[derive(Debug, serde::Serialize)]
struct EncodedMarks {
    scheme: String,
    kind: &'static str,
    block: usize,
}

#[derive(Debug, serde::Serialize)]
struct EncodedView {
    scheme: String,
    given: String,
    block: usize,
}

#[derive(Debug, serde::Serialize)]
struct EncodedGraph {
    given: String,
    /// Neighbors per keypoint; fewer are filled up with places that are not drawn.
    k: usize,
    block: usize,
}

/// Encodes up to [`MOST_PICTURES`] pictures and appends their blocks to `blocks`. Keypoints are thinned
/// out where all of them would break the budget.
pub(crate) fn encode(pictures: &[Picture], blocks: &mut Vec<String>) -> Vec<EncodedPicture> {
    let pictures = &pictures[..pictures.len().min(MOST_PICTURES)];
    let each = BUDGET_BYTES / pictures.len().max(1);
    pictures.iter().map(|picture| one(picture, each, blocks)).collect()
}

fn one(picture: &Picture, budget: usize, blocks: &mut Vec<String>) -> EncodedPicture {
    let points = 1
        + 2 * picture.released.len()
        + picture.views.len()
        + GRAPH_NEIGHBORS * picture.graphs.len();
    let most = budget / (BYTES_PER_POINT * points);
    let chosen = subsample(picture.keypoints.len(), most, 0);
    let place = |point: Option<[f32; 2]>| quantize(picture.size, point);
    let mut push = |bytes: Vec<u8>| {
        blocks.push(STANDARD.encode(bytes));
        blocks.len() - 1
    };
    let photo = picture.photo.as_ref().map(|jpeg| push(jpeg.clone()));
    let keypoints = push(chosen.iter().flat_map(|&i| place(Some(picture.keypoints[i]))).collect());
    let released = picture.released.iter().map(|view| {
        let ends = |segments: &[Option<[[f32; 2]; 2]>]| -> Vec<u8> {
            let both = |&i: &usize| {
                let segment = segments.get(i).copied().flatten();
                [0, 1].map(|end| place(segment.map(|segment| segment[end])))
            };
            chosen.iter().flat_map(both).flatten().collect()
        };
        let (kind, bytes) = match &view.marks {
            Marks::Lines(all) => ("lines", ends(all)),
            Marks::Rays(all) => ("rays", ends(all)),
            Marks::Points(all) => ("points", at(all, &chosen, place)),
        };
        EncodedMarks { scheme: view.scheme.clone(), kind, block: push(bytes) }
    });
    let released = released.collect();
    let views = picture.views.iter().map(|view| EncodedView {
        scheme: view.scheme.clone(),
        given: label(&view.given),
        block: push(at(&view.recovered, &chosen, place)),
    });
    let views = views.collect();
    let graphs = picture.graphs.iter().map(|graph| {
        let listed = |&i: &usize| {
            let of = graph.neighbors.get(i).map(Vec::as_slice).unwrap_or_default();
            (0..GRAPH_NEIGHBORS).flat_map(|at| place(of.get(at).copied())).collect::<Vec<u8>>()
        };
        let block = push(chosen.iter().flat_map(listed).collect());
        EncodedGraph { given: label(&graph.given), k: GRAPH_NEIGHBORS, block }
    });
    let graphs = graphs.collect();
    EncodedPicture {
        name: picture.name.clone(),
        note: picture.note.clone(),
        size: picture.size,
        photo,
        n_keypoints: picture.keypoints.len(),
        n_drawn: chosen.len(),
        keypoints,
        released,
        views,
        graphs,
    }
}

fn at(
    all: &[Option<[f32; 2]>],
    chosen: &[usize],
    place: impl Fn(Option<[f32; 2]>) -> [u8; BYTES_PER_POINT],
) -> Vec<u8> {
    chosen.iter().flat_map(|&i| place(all.get(i).copied().flatten())).collect()
}

/// Little-endian u16 pair, 0..=65534 across the image; what lies outside goes to its border.
fn quantize(size: [u32; 2], point: Option<[f32; 2]>) -> [u8; BYTES_PER_POINT] {
    let steps = |c: usize| {
        let share = (point?[c] + 0.5) / size[c].max(1) as f32;
        share.is_finite().then(|| (share.clamp(0.0, 1.0) * f32::from(NOT_DRAWN - 1)).round() as u16)
    };
    let [x, y] = match (steps(0), steps(1)) {
        (Some(x), Some(y)) => [x, y].map(u16::to_le_bytes),
        _ => [NOT_DRAWN; 2].map(u16::to_le_bytes),
    };
    [x[0], x[1], y[0], y[1]]
}

/// How neighborhoods are called on the page: `50 %`, `50 %, near`, `overlap, 18 %`.
fn label(given: &Given) -> String {
    let right = words::ratio_percent(given.inlier_ratio);
    match (given.neighbors.as_str(), given.oracle_noise.as_deref()) {
        ("oracle", None | Some("uniform")) => format!("{right} %"),
        ("oracle", Some(noise)) => format!("{right} %, {noise}"),
        (source, _) => format!("{source}, {right} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_an_image_are_the_ends_of_the_scale() {
        let ends = |point| {
            let [a, b, c, d] = quantize([640, 480], point);
            [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])]
        };
        assert_eq!(ends(Some([-0.5, -0.5])), [0, 0]);
        assert_eq!(ends(Some([639.5, 479.5])), [65534, 65534]);
        assert_eq!(ends(Some([9000.0, 239.5])), [65534, 32767]);
        assert_eq!(ends(None), [65535, 65535]);
        assert_eq!(ends(Some([f32::NAN, 0.0])), [65535, 65535]);
    }

    #[test]
    fn a_budget_thins_keypoints_out() {
        let keypoints = vec![[1.0, 2.0]; 1000];
        let picture = Picture { size: [9, 9], keypoints, ..Picture::default() };
        let mut blocks = Vec::new();
        let encoded = one(&picture, 400, &mut blocks);
        assert_eq!((encoded.n_drawn, encoded.n_keypoints), (100, 1000));
        assert_eq!(STANDARD.decode(&blocks[0]).unwrap().len(), 400);
    }

    #[test]
    fn neighborhoods_are_called_by_share_or_source() {
        let given = |neighbors: &str, noise: Option<&str>| Given {
            neighbors: neighbors.into(),
            oracle_noise: noise.map(str::to_owned),
            inlier_ratio: 0.183,
        };
        assert_eq!(label(&given("oracle", Some("uniform"))), "18 %");
        assert_eq!(label(&given("oracle", Some("near"))), "18 %, near");
        assert_eq!(label(&given("overlap", None)), "overlap, 18 %");
    }
}
