//! twinray
