//! Layout of the room: walls, floor, ceiling, and positions of furniture.

use super::furniture as piece;
use super::surfaces::{FLOOR, Faces, PAINT, Piece, Place, SMOOTH, Scene, turn};
use super::{Purpose, draws};
use crate::seed::Draws;

/// Free space at the ends of a short wall, for the furniture of the long walls.
const CORNER: f64 = 0.85;

pub(super) fn furnished(seed: u64) -> Scene {
    let mut draws = draws(seed, Purpose::Layout, 0);
    let size = [draws.between(4.8, 5.3), draws.between(3.8, 4.2), draws.between(2.5, 2.7)];
    let mut scene = Scene::new(size);
    let walls = shell(&mut scene);

    // Furniture is assigned to one of two opposite walls at random.
    let mut long = [0, 2];
    let mut short = [1, 3];
    draws.shuffle(&mut long);
    draws.shuffle(&mut short);
    storage_wall(scene.at(walls[long[0]]), size[0], &mut draws);
    door_wall(scene.at(walls[long[1]]), size[0], &mut draws);
    desk_wall(scene.at(walls[short[0]]), size[1], &mut draws);
    sofa_wall(scene.at(walls[short[1]]), size[1], &mut draws);
    dining(&mut scene, size, &mut draws);
    scene
}

/// Adds floor, ceiling and walls. Returns the place of each wall.
fn shell(scene: &mut Scene) -> [Place; 4] {
    let [l, w, h] = scene.size;
    let wall = |origin, turn| Place { origin, turn };
    let walls = [
        wall([0.0, 0.0, 0.0], [1.0, 0.0]),
        wall([l, 0.0, 0.0], [0.0, 1.0]),
        wall([l, w, 0.0], [-1.0, 0.0]),
        wall([0.0, w, 0.0], [0.0, -1.0]),
    ];
    let (x, y) = ([l, 0.0, 0.0], [0.0, w, 0.0]);
    let mut floor = scene.at(walls[0]);
    floor.sheet([0.0; 3], x, y, FLOOR);
    floor.sheet([0.0, 0.0, h], y, x, PAINT);
    for (&place, length) in walls.iter().zip([l, w, l, w]) {
        let mut wall = scene.at(place);
        wall.sheet([0.0; 3], [0.0, 0.0, h], [length, 0.0, 0.0], PAINT);
        // Baseboard.
        wall.shell([0.0; 3], [length, 0.012, 0.07], Faces::FrontAndTop, SMOOTH);
    }
    walls
}

/// Adds bookshelf, tall cabinet and plant in random order.
fn storage_wall(mut wall: Piece<'_>, length: f64, draws: &mut Draws) {
    let widths = [draws.between(1.5, 1.9), draws.between(0.85, 1.1), draws.between(0.4, 0.5)];
    let [shelf, cabinet, plant] = side_by_side(widths, 0.08, length - 0.08, draws);
    piece::bookshelf(wall.at([shelf, 0.0, 0.0]), widths[0], draws);
    piece::tall_cabinet(wall.at([cabinet, 0.0, 0.0]), widths[1], draws);
    piece::plant(wall.at([plant + 0.5 * widths[2], 0.3, 0.0]), draws);
}

/// Adds sideboard with pictures above it, door and floor lamp in random order.
fn door_wall(mut wall: Piece<'_>, length: f64, draws: &mut Draws) {
    let widths = [draws.between(1.4, 1.8), 0.95, 0.45];
    let [sideboard, door, lamp] = side_by_side(widths, 0.08, length - 0.08, draws);
    piece::sideboard(wall.at([sideboard, 0.0, 0.0]), widths[0], draws);
    piece::pictures(wall.at([sideboard, 0.0, 0.0]), widths[0], 1.35, draws);
    piece::door(wall.at([door, 0.0, 0.0]), widths[1]);
    piece::floor_lamp(wall.at([lamp + 0.22, 0.28, 0.0]), draws);
}

/// Adds a window, and a desk with a chair in front of it.
fn desk_wall(mut wall: Piece<'_>, length: f64, draws: &mut Draws) {
    let width = draws.between(1.2, 1.6);
    let start = draws.between(CORNER, length - CORNER - width);
    piece::window(wall.at([0.0; 3]), 0.5 * length, draws);
    let mut desk = wall.at([start, 0.0, 0.0]);
    piece::desk(desk.at([0.0; 3]), width, draws);
    // Turns the chair by 180 degrees (half angle 90 degrees), so that it faces the desk.
    piece::chair(desk.turned([0.5 * width, 0.95, 0.0], [-1.0, 0.0]), draws);
}

fn sofa_wall(mut wall: Piece<'_>, length: f64, draws: &mut Draws) {
    let width = draws.between(1.7, 2.0);
    let start = draws.between(CORNER, length - CORNER - width);
    piece::sofa(wall.at([start, 0.0, 0.0]), width, draws);
    piece::pictures(wall.at([start, 0.0, 0.0]), width, 1.3, draws);
}

/// Adds rug, table, chairs and pendant lamp in the middle.
fn dining(scene: &mut Scene, size: [f64; 3], draws: &mut Draws) {
    let place = Place {
        origin: [
            0.5 * size[0] + draws.between(-0.2, 0.2),
            0.5 * size[1] + draws.between(-0.15, 0.15),
            0.0,
        ],
        turn: turn(draws.between(-0.06, 0.06)),
    };
    let mut middle = scene.at(place);
    let (length, depth) = (draws.between(1.25, 1.6), draws.between(0.75, 0.9));
    piece::rug(middle.at([0.0; 3]), draws);
    piece::table(middle.at([0.0; 3]), length, depth, draws);
    for (x, side) in [(-0.25, -1.0), (0.25, -1.0), (-0.25, 1.0), (0.25, 1.0)] {
        // Chairs differ in distance and are not quite straight.
        let y = side * (0.5 * depth + draws.between(0.0, 0.22));
        let small = turn(draws.between(-0.12, 0.12));
        let towards = [-side * small[0], -side * small[1]];
        let place = [x * length + draws.between(-0.05, 0.05), y, 0.0];
        piece::chair(middle.turned(place, towards), draws);
    }
    piece::pendant(middle, size[2]);
}

/// Returns the starts of pieces with these widths, in random order and with random gaps.
fn side_by_side(widths: [f64; 3], from: f64, to: f64, draws: &mut Draws) -> [f64; 3] {
    let slack = (to - from - widths.iter().sum::<f64>()).max(0.0);
    let gaps: [f64; 4] = std::array::from_fn(|_| 0.2 + draws.unit());
    let per_gap = slack / gaps.iter().sum::<f64>();
    let mut order = [0, 1, 2];
    draws.shuffle(&mut order);
    let mut starts = [0.0; 3];
    let mut at = from;
    for (gap, i) in gaps.into_iter().zip(order) {
        at += gap * per_gap;
        starts[i] = at;
        at += widths[i];
    }
    starts
}
