//! The network YOLOX-nano: everyday objects in pictures.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("yolox-nano.onnx");
