//! A network that scores near points by their SIFT descriptors.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("neighbors-sift.onnx");
