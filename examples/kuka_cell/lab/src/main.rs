//! A stand-in for the lab of the gearbox cell, where no robot is at hand.
//!
//! It is reached as a simulator is that is a program (`process "kuka_cell_lab"`), and differs from the model: targets
//! arrive later, the zones were measured a little differently, an axis has a limit that the model does not know. Its
//! arguments say by how much, so that a study can be repeated with other gaps, or with none.

use std::io;
use std::process::ExitCode;

use kuka_cell_sim::RealCell;
use kuka_cell_sim::lab::Reality;
use sesame_runtime::simulator::serve;
use sesame_runtime::time::SimTime;

const HELP: &str = "\
A stand-in for the lab of the KUKA gearbox cell. It speaks the protocol of docs/process.md.

Usage: kuka_cell_lab [OPTION VALUE]…

      --latency MS        how late targets arrive at the drives [default: 50]
      --noise SHARE       the strength of the torque noise, as a share of the model's [default: 1]
      --zone-shift X,Y,Z  how far the zones are from where the model has them, in mm [default: 30,-20,0]
      --soft-limit RAD    targets of the product arm's second axis are cut to this; `none` for no limit [default: 1.1]
      --as-modelled       no difference from the noisy model, except for the options after it
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        eprint!("{HELP}");
        return ExitCode::SUCCESS;
    }
    let reality = match reality(&arguments) {
        Ok(reality) => reality,
        Err(wrong) => {
            eprintln!("error: {wrong}; see --help");
            return ExitCode::from(2);
        }
    };
    let (input, output) = (io::stdin().lock(), io::stdout().lock());
    match serve(input, output, |setup, bus| RealCell::start_as(&reality, setup, bus)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What the arguments say.
fn reality(arguments: &[String]) -> Result<Reality, String> {
    let mut reality = Reality::default();
    let mut arguments = arguments.iter();
    while let Some(option) = arguments.next() {
        if option == "--as-modelled" {
            reality = Reality::AS_MODELLED;
            continue;
        }
        let value = arguments.next().map(String::as_str);
        let value = value.ok_or_else(|| format!("`{option}` needs a value, or is not an option"))?;
        match option.as_str() {
            "--latency" => reality.latency = SimTime::from_seconds(not_negative(option, value)? / 1000.0),
            "--noise" => reality.noise_share = not_negative(option, value)?,
            "--zone-shift" => {
                let axes: Vec<f64> = value.split(',').map(|axis| number(option, axis)).collect::<Result<_, _>>()?;
                let axes: [f64; 3] = axes.try_into().map_err(|_| format!("`{option}` takes three numbers"))?;
                reality.zone_shift = axes.map(|axis| axis / 1000.0);
            }
            "--soft-limit" if value == "none" => reality.soft_limit = None,
            "--soft-limit" => reality.soft_limit = Some(not_negative(option, value)?),
            _ => return Err(format!("there is no option `{option}`")),
        }
    }
    Ok(reality)
}

fn number(option: &str, value: &str) -> Result<f64, String> {
    let number = value.trim().parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("`{value}` is not a number for `{option}`"))
}

fn not_negative(option: &str, value: &str) -> Result<f64, String> {
    let number = number(option, value)?;
    // More would not be a time of the simulation.
    if (0.0..=1e6).contains(&number) {
        Ok(number)
    } else {
        Err(format!("`{option}` is from 0 to 1000000, not {value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(arguments: &[&str]) -> Result<Reality, String> {
        reality(&arguments.iter().map(|&argument| argument.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn arguments_change_single_differences() {
        assert_eq!(read(&[]), Ok(Reality::default()));
        assert_eq!(read(&["--latency", "80", "--as-modelled"]), Ok(Reality::AS_MODELLED));
        let latency = SimTime::from_nanos(80_000_000);
        assert_eq!(read(&["--as-modelled", "--latency", "80"]), Ok(Reality { latency, ..Reality::AS_MODELLED }));
        let shifted = read(&["--zone-shift", "1, -2.5,0", "--noise", "0.5", "--soft-limit", "none"]);
        let zone_shift = [0.001, -0.0025, 0.0];
        assert_eq!(shifted, Ok(Reality { zone_shift, noise_share: 0.5, soft_limit: None, ..Reality::default() }));
    }

    #[test]
    fn wrong_arguments_are_named() {
        let wrong = |arguments: &[&str]| read(arguments).unwrap_err();
        assert_eq!(wrong(&["--latency"]), "`--latency` needs a value, or is not an option");
        assert_eq!(wrong(&["--latency", "-1"]), "`--latency` is from 0 to 1000000, not -1");
        assert_eq!(wrong(&["--noise", "NaN"]), "`NaN` is not a number for `--noise`");
        assert_eq!(wrong(&["--zone-shift", "1,2"]), "`--zone-shift` takes three numbers");
        assert_eq!(wrong(&["--warp", "9"]), "there is no option `--warp`");
    }
}
