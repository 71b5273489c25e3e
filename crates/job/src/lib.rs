//! Run a scene on a renderer and report what happens
