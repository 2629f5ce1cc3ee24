//! Result pages as pictures, by a browser without a window.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// File name of a result page.
pub const FILE: &str = "view.html";

/// Browsers, the first that starts is taken.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Writes the result page of a run.
pub fn write(program: &Path, output: &Path) -> Result<()> {
    let ended = Command::new(program)
        .arg("view")
        .arg(output)
        .stdout(Stdio::null())
        .status()
        .into_diagnostic()
        .wrap_err_with(|| program.display().to_string())?;
    if !ended.success() {
        return Err(miette!("{} view {}: {ended}", program.display(), output.display()));
    }
    Ok(())
}

/// Takes a picture of a page, 1400 × 1000 pixels, and returns its file.
///
/// # Errors
/// No browser, or one that writes no picture.
pub fn photograph(page: &Path) -> Result<PathBuf> {
    let page = page.canonicalize().into_diagnostic().wrap_err_with(|| page.display().to_string())?;
    let picture = page.with_extension("png");
    let screenshot = format!("--screenshot={}", picture.display());
    for browser in BROWSERS {
        let ended = Command::new(browser)
            .args(["--headless=new", "--no-sandbox", "--hide-scrollbars", "--window-size=1400,1000"])
            .args(["--force-device-scale-factor=1", "--virtual-time-budget=20000", &screenshot])
            .arg(format!("file://{}", page.display()))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if ended.is_ok_and(|ended| ended.success()) && picture.is_file() {
            return Ok(picture);
        }
    }
    Err(miette!("{}: needs one of {} to take a picture", page.display(), BROWSERS.join(", ")))
}
