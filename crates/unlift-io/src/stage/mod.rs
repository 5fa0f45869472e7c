//! Stage files: what passes between the commands, as Parquet tables.
//!
//! One file per kind, or a folder of its parts, described for writers in other languages in `docs/formats.md`. A file holds
//! one kind only, and released maps, neighborhoods and recovered points hold nothing of the truth:
//! no ids, names or times of their source, so that equal values make equal bytes.
//!
//! Readers are lenient where nothing is lost: any width of numbers, any kind of list, null or NaN for what is not
//! there, metadata only where columns do not tell, columns only where they mean something. Everything else that is not as
//! documented is one line naming the file, the column and row (counted from 0), what was expected and what was found.

mod column;
mod file;
mod footer;
mod header;
mod image_writer;
mod images;
mod manifest;
mod neighborhoods;
mod order;
mod pages;
mod parts;
mod peek;
mod recovered;
mod released;
mod split;
mod table;
mod thrift;
mod truth;
mod write;

pub use header::Kind;
pub use image_writer::ImageWriter;
pub use images::{ImageFile, ImageRows, has_images};
pub use neighborhoods::{
    PointNeighborhoods, read_neighborhoods, read_point_neighborhoods, write_neighborhoods,
};
pub use parts::part_files;
pub use peek::{Header, declared_kind, peek};
pub use recovered::{read_recovered, read_recovered_in, write_recovered};
pub use released::{read_released, scheme_name, write_released};
pub use split::Split;
pub use truth::{read_truth, write_truth};
