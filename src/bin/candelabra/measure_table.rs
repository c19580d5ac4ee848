//! What was measured, for a terminal.

use anyhow::Result;
use candelabra::measure::{ProbeReport, Report, Trade};
use candelabra::page::{Count, Lines, Short};
use std::io::Write;

/// Prints the tables of a report.
pub fn print(out: &mut impl Write, report: &Report) -> Result<()> {
    let out = &mut Lines(out);
    if let Some(exact) = &report.exact {
        print_exact(out, exact)?;
    }
    if let Some(trade) = &report.trade {
        if report.exact.is_some() {
            writeln!(out)?;
        }
        print_trade(out, trade)?;
    }
    Ok(())
}

fn print_exact(out: &mut impl Write, exact: &ProbeReport) -> Result<()> {
    writeln!(
        out,
        "exact variance of picking one of {} lights, at {} points",
        Count(exact.lights),
        Count(exact.probes)
    )?;
    writeln!(
        out,
        "{:<24} {:>11} {:>11} {:>11} {:>8} {:>8}",
        "", "mean", "median", "9 of 10", "lights", "ns"
    )?;
    for row in &exact.strategies {
        writeln!(
            out,
            "{:<24} {:>11} {:>11} {:>11} {:>8.2} {:>8.0}",
            row.name,
            Short(row.variance).to_string(),
            Short(row.median).to_string(),
            Short(row.ninth_decile).to_string(),
            row.lights,
            row.nanoseconds
        )?;
    }
    let grey = Short(exact.grey.luminance());
    writeln!(out, "variance over the square of the light plus the grey floor, {grey}; ideally 0")?;
    Ok(())
}

fn print_trade(out: &mut impl Write, trade: &Trade) -> Result<()> {
    writeln!(
        out,
        "{:<24} {:>8} {:>9} {:>9} {:>6} {:>10} {:>10} {:>8}",
        "", "samples", "seconds", "error", "dB", "worst 1 %", "mean off", "lights"
    )?;
    for row in &trade.rows {
        writeln!(
            out,
            "{:<24} {:>8} {:>9.3} {:>9.4} {:>6} {:>10.3} {:>8.2} % {:>8.2} {}",
            row.way(),
            row.samples,
            row.seconds,
            row.error,
            row.decibels.map_or(String::new(), |decibels| format!("{decibels:.1}")),
            row.worst_percent,
            100.0 * row.mean_off,
            row.lights,
            if row.is_on_frontier { "*" } else { "" }
        )?;
    }
    writeln!(out, "* nothing else has less error in no more time")?;
    writeln!(out)?;
    let wanted = format!("error {} takes", trade.terms.error);
    writeln!(out, "{:<24} {:>8} {:>20}", "", "slope", wanted)?;
    for curve in &trade.curves {
        let slope = curve.slope.map_or(String::new(), |slope| format!("{slope:.2}"));
        let takes = curve.reach.map_or(String::new(), |reach| {
            let sure = if reach.is_beyond { " (extrapolated)" } else { "" };
            format!("{:>18.3} s, {} samples{sure}", reach.seconds, reach.samples)
        });
        writeln!(out, "{:<24} {slope:>8} {takes}", curve.name)?;
    }
    writeln!(
        out,
        "{} pictures each; grey floor {}; a reference of {} samples, its own error {}",
        trade.terms.seeds,
        Short(trade.terms.grey.luminance()),
        Count(trade.terms.reference_samples as usize),
        Short(trade.terms.reference_error)
    )?;
    writeln!(out, "{}", trade.recommendation)?;
    Ok(())
}
