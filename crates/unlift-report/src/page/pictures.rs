//! Chosen images on the page: photo, keypoints, released records and recovered keypoints.
//!
//! Positions are in pixels. The center of the first pixel is `(0, 0)`, so an image of width `w` spans
//! `-0.5` to `w - 0.5`.

use serde_json::{Value, json};

use crate::attack::{self, ByAttack};
use crate::document::Row;
use crate::page::blocks::{Blocks, NOT_DRAWN, coordinate};
use crate::page::scene::subsample;
use crate::words;

/// Maximal number of images on a page, which stays below 10 MB.
pub const MOST_PICTURES: usize = 12;
/// Number of neighbors per keypoint in a graph.
pub const GRAPH_NEIGHBORS: usize = 5;

/// An image of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The image's name.
    pub name: String,
    /// The reason for its choice, for example `worst`; may be empty.
    pub note: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The photo as a small JPEG; `None` draws a gray frame.
    pub photo: Option<Vec<u8>>,
    /// True positions of the `n` keypoints.
    pub keypoints: Vec<[f32; 2]>,
    /// Released records, one entry per scheme.
    pub released: Vec<ReleasedView>,
    /// Recovered keypoints, one entry per attack.
    pub views: Vec<View>,
    /// Graphs of neighbors, one per kind of neighborhoods.
    pub graphs: Vec<Graph>,
}

/// The released records of one scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleasedView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The records, one per keypoint of [`Picture::keypoints`] in the same order.
    pub marks: Marks,
}

/// Records as drawn; `None` if a keypoint was not released.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// Lines clipped to the image.
    Lines(Vec<Option<[[f32; 2]; 2]>>),
    /// Half-lines from an anchor (the first end) to the border of their part of the image.
    Rays(Vec<Option<[[f32; 2]; 2]>>),
    /// Published points with one coordinate of another keypoint.
    Points(Vec<Option<[f32; 2]>>),
}

/// Recovered positions, one per keypoint of [`Picture::keypoints`]; `None` if it is lost or was not released.
pub type View = ByAttack<Vec<Option<[f32; 2]>>>;

/// A graph of neighborhoods: per keypoint up to [`GRAPH_NEIGHBORS`] neighbors.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    /// A row with these neighborhoods.
    pub row: Row,
    /// True positions of the neighbors, per keypoint of [`Picture::keypoints`].
    pub neighbors: Vec<Vec<[f32; 2]>>,
}

/// Maximal number of bytes of all pictures without their photos, before base64.
const BUDGET_BYTES: usize = 3_600_000;
const BYTES_PER_POINT: usize = 2 * size_of::<u16>();

/// Returns the key of the neighborhoods that are shown first: those made by the attacker that recover most of the first picture.
pub(crate) fn first_choice(pictures: &[Picture], within: f64) -> Option<String> {
    let first = pictures.first()?;
    let own = first.views.iter().filter(|view| !attack::is_oracle(&view.row.neighbors));
    let share = |view: &View| recovered(first, view, within).0;
    own.max_by(|a, b| share(a).total_cmp(&share(b))).map(|view| key(&view.row))
}

/// Edges below this fraction of the smaller side are short, as in the paper's figures.
const SHORT_SHARE: f32 = 0.1;

/// Encodes up to [`MOST_PICTURES`] pictures and appends their blocks to `blocks`. Keypoints are thinned
/// to keep the budget. Shares within `within` pixels are over all released keypoints.
pub(crate) fn encode(pictures: &[Picture], within: f64, blocks: &mut Blocks) -> Vec<Value> {
    let pictures = &pictures[..pictures.len().min(MOST_PICTURES)];
    let budget = BUDGET_BYTES / pictures.len().max(1);
    pictures.iter().map(|picture| encode_picture(picture, budget, within, blocks)).collect()
}

fn encode_picture(picture: &Picture, budget: usize, within: f64, blocks: &mut Blocks) -> Value {
    let points = 1
        + 2 * picture.released.len()
        + picture.views.len()
        + GRAPH_NEIGHBORS * picture.graphs.len();
    let chosen = subsample(picture.keypoints.len(), budget / (BYTES_PER_POINT * points), 0);
    let short_px = SHORT_SHARE * picture.size[0].min(picture.size[1]) as f32;
    let photo = picture.photo.as_ref().map(|jpeg| blocks.push(jpeg));
    // Adds a block with places of every chosen keypoint.
    let mut push = |of: &dyn Fn(usize) -> Vec<Option<[f32; 2]>>| {
        let places = chosen.iter().flat_map(|&i| of(i));
        let bytes = places.flat_map(|place| quantize(picture.size, place));
        blocks.push(bytes.collect::<Vec<u8>>())
    };
    let keypoints = push(&|i| vec![Some(picture.keypoints[i])]);
    let released = picture.released.iter().map(|view| {
        let kind = match view.marks {
            Marks::Lines(_) => "lines",
            Marks::Rays(_) => "rays",
            Marks::Points(_) => "points",
        };
        let block = push(&|i| view.marks.places(i));
        json!({ "scheme": view.scheme, "kind": kind, "block": block })
    });
    let released: Vec<Value> = released.collect();
    let views = picture.views.iter().map(|view| {
        json!({
            "scheme": view.row.scheme,
            // The key of the neighborhoods, equal in all pictures.
            "given": key(&view.row),
            "label": attack::label(&view.row),
            "solver": view.row.solver,
            "block": push(&|i| vec![at(&view.recovered, i)]),
            "said": recovered(picture, view, within).1,
        })
    });
    let views: Vec<Value> = views.collect();
    let graphs = picture.graphs.iter().map(|graph| {
        // Shorter lists are padded with points that are not drawn.
        let listed = |i: usize| {
            let of = graph.neighbors.get(i).map(Vec::as_slice).unwrap_or_default();
            (0..GRAPH_NEIGHBORS).map(|rank| of.get(rank).copied()).collect()
        };
        let text = edges(picture, graph, short_px);
        json!({ "given": key(&graph.row), "said": text, "k": GRAPH_NEIGHBORS, "block": push(&listed) })
    });
    let graphs: Vec<Value> = graphs.collect();
    let n = picture.keypoints.len();
    let [all, drawn] = [n, chosen.len()].map(words::thousands);
    let some = if chosen.len() < n { format!(", {drawn} of them drawn") } else { String::new() };
    let [w, h] = picture.size;
    json!({
        "name": picture.name,
        "note": picture.note,
        "size": picture.size,
        "photo": photo,
        "said": format!("{}, {w} x {h} px, {all} keypoints{some}", picture.name),
        "keypoints": keypoints,
        "short_px": short_px,
        "released": released,
        "views": views,
        "graphs": graphs,
    })
}

/// Returns the record of keypoint `i`; `None` also if `all` is too short.
fn at<T: Copy>(all: &[Option<T>], i: usize) -> Option<T> {
    all.get(i).copied().flatten()
}

impl Marks {
    /// Returns the ends of the record of keypoint `i`, or its point.
    fn places(&self, i: usize) -> Vec<Option<[f32; 2]>> {
        match self {
            Self::Lines(all) | Self::Rays(all) => {
                [0, 1].map(|end| at(all, i).map(|ends| ends[end])).to_vec()
            }
            Self::Points(all) => vec![at(all, i)],
        }
    }
}

/// Encodes a position as a little-endian u16 pair, 0..=65534 across the image; points outside move to the border.
fn quantize(size: [u32; 2], point: Option<[f32; 2]>) -> impl Iterator<Item = u8> {
    let shares = point.map(|point| [0, 1].map(|c| (point[c] + 0.5) / size[c].max(1) as f32));
    let shares = shares.filter(|shares| shares.iter().all(|share| share.is_finite()));
    let steps = shares.map_or([NOT_DRAWN; 2], |shares| shares.map(coordinate));
    steps.into_iter().flat_map(u16::to_le_bytes)
}

/// Returns the key of neighborhoods, without a measured ratio, which differs between images.
fn key(row: &Row) -> String {
    let source = attack::source(row);
    match attack::is_oracle(&row.neighbors) {
        true => format!("{source} {}", row.inlier_ratio),
        false => source,
    }
}

/// Returns the share of the released keypoints, drawn or not, and a sentence: "81.3 % within 10 px (blue), the others orange; 3 lost".
fn recovered(picture: &Picture, view: &View, within: f64) -> (f64, String) {
    let released = picture.released.iter().find(|of| of.scheme == view.row.scheme);
    let is_released = |i: usize| released.is_none_or(|of| of.marks.places(i)[0].is_some());
    let keypoints = picture.keypoints.iter().enumerate().filter(|(i, _)| is_released(*i));
    let error = |(i, &truth): (usize, &[f32; 2])| {
        at(&view.recovered, i).map(|place| distance(place, truth))
    };
    let errors: Vec<Option<f64>> = keypoints.map(error).collect();
    let hits = errors.iter().flatten().filter(|error| **error <= within).count();
    let lost = errors.iter().filter(|error| error.is_none()).count();
    let share = 100.0 * hits as f64 / errors.len().max(1) as f64;
    let lost = if lost > 0 { format!("; {} lost", words::thousands(lost)) } else { String::new() };
    let (percent, within) = (words::percent(share), words::significant(within, 3));
    (share, format!("{percent} % within {within} px (blue), the others orange{lost}"))
}

/// Returns a sentence: "the first five neighbors of each keypoint; 45.1 % of the edges are shorter than
/// 48 px (green), the others red".
fn edges(picture: &Picture, graph: &Graph, short_px: f32) -> String {
    let edges = picture.keypoints.iter().zip(&graph.neighbors).flat_map(|(from, neighbors)| {
        neighbors.iter().take(GRAPH_NEIGHBORS).map(|to| distance(*from, *to))
    });
    let short = edges.clone().filter(|length| *length < f64::from(short_px)).count();
    let share = words::percent(100.0 * short as f64 / edges.count().max(1) as f64);
    let reach = words::significant(f64::from(short_px), 3);
    format!(
        "the first five neighbors of each keypoint; {share} % of the edges are shorter than {reach} px (green), the others red"
    )
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f64 {
    f64::from(a[0] - b[0]).hypot(f64::from(a[1] - b[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_released_keypoints() {
        let picture = Picture {
            size: [100, 50],
            keypoints: vec![[0.0, 0.0]; 5],
            released: vec![ReleasedView {
                scheme: "cp2d".into(),
                marks: Marks::Points(vec![
                    Some([1.0, 1.0]),
                    Some([1.0, 1.0]),
                    None,
                    Some([2.0; 2]),
                    Some([3.0; 2]),
                ]),
            }],
            ..Picture::default()
        };
        let view = View {
            row: Row { scheme: "cp2d".into(), ..Row::default() },
            recovered: vec![Some([3.0, 4.0]), Some([30.0, 4.0]), None, None, Some([5.0, 0.0])],
        };
        let (_, text) = recovered(&picture, &view, 5.0);
        assert_eq!(text, "50.0 % within 5 px (blue), the others orange; 1 lost");
        let graph = Graph { row: Row::default(), neighbors: vec![vec![[3.0, 0.0], [5.0, 0.0]]] };
        let text = edges(&picture, &graph, 5.0);
        assert!(text.contains("50.0 % of the edges are shorter than 5 px"), "{text}");
    }
}
