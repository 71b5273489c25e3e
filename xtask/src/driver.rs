//! A Vulkan driver for the tests that draw: the one that is there, or a software driver that is installed.
//!
//! Only files are looked at: this has to compile in seconds, and opening a driver is what the tests do. So a
//! manifest stands for its driver, as it does for the Vulkan loader, in whose order it is looked for. It counts if it is
//! for this architecture, and if the driver has something to drive: drivers of graphics cards come in one package, and
//! lie on machines without any.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

/// What is installed on Debian and its descendants: Mesa's drivers, lavapipe among them, and the loader.
pub const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// What to do by hand where nothing can be installed.
pub const REMEDY: &str = "\
install a software driver, then try again:
  Debian, Ubuntu: sudo apt-get install --no-install-recommends mesa-vulkan-drivers libvulkan1
  Fedora:         sudo dnf install mesa-vulkan-drivers vulkan-loader
  Arch:           sudo pacman -S vulkan-swrast vulkan-icd-loader";

/// The library through which programs reach the drivers.
const LOADER: &str = "libvulkan.so.1";

/// Finds a driver, or installs one; says which it is.
///
/// Nothing is installed where there is one already, nor on macOS and Windows, whose own interfaces are used.
///
/// # Errors
/// When there is no driver and none can be installed; the error says what to do about it.
pub fn provide() -> Result<String> {
    if cfg!(any(target_os = "macos", windows)) {
        return Ok("the system brings its own graphics driver".to_owned());
    }
    let places = Places::of_this_machine();
    let found = places.look();
    match plan(&found, places.named_by, rights) {
        Plan::Nothing => Ok(found.to_string()),
        Plan::Fail(why) => bail!(why),
        Plan::Install(rights) => {
            println!("{found}\ninstalling {}", PACKAGES.join(" and "));
            for command in apt_commands(rights) {
                run(&command)?;
            }
            let found = Places::of_this_machine().look();
            ensure!(found.is_enough(), "even after the installation there is {found}; {REMEDY}");
            Ok(found.to_string())
        }
    }
}

/// What is to be done about what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Plan {
    Nothing,
    Install(Rights),
    /// With the reason, and the way out.
    Fail(String),
}

/// Decides; `rights` is asked only where something has to be installed.
fn plan(found: &Found, named_by: Option<&str>, rights: impl FnOnce() -> Option<Rights>) -> Plan {
    if found.is_enough() {
        return Plan::Nothing;
    }
    if let (true, Some(variable)) = (found.manifests.is_empty(), named_by) {
        // The loader would not look at what is installed either.
        return Plan::Fail(format!(
            "{variable} names no manifest of a Vulkan driver that can be used here; correct it, or unset it so that the \
             drivers of the system are used"
        ));
    }
    rights().map_or_else(|| Plan::Fail(format!("there is {found}; {REMEDY}")), Plan::Install)
}

/// Where a driver is looked for.
#[derive(Clone, Debug, Default)]
struct Places {
    /// Manifests, or folders of them.
    manifests: Vec<PathBuf>,
    /// The variable that named them, if one did: then the loader looks nowhere else.
    named_by: Option<&'static str>,
    /// Folders of libraries.
    libraries: Vec<PathBuf>,
    /// Libraries that the dynamic linker knows, as `ldconfig -p` prints them.
    linker_cache: String,
    /// Whether there is a graphics card that programs can open.
    has_card: bool,
}

impl Places {
    fn of_this_machine() -> Self {
        Self { has_card: has_card(Path::new("/dev")), ..Self::new(|name| std::env::var_os(name), linker_cache()) }
    }

    /// From the variables of the environment.
    fn new(variable: impl Fn(&str) -> Option<OsString>, linker_cache: String) -> Self {
        let set = |name: &str| variable(name).filter(|value| !value.is_empty());
        let list = |name: &str| -> Vec<PathBuf> {
            let value = set(name).unwrap_or_default();
            std::env::split_paths(&value).filter(|path| !path.as_os_str().is_empty()).collect()
        };
        let of_user = |name: &str, in_home: &str| {
            let home = || set("HOME").map(|home| Path::new(&home).join(in_home));
            set(name).map(PathBuf::from).or_else(home)
        };

        // The second is the older name; the loader ignores it where both are set.
        let named_by = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].into_iter().find(|&name| set(name).is_some());
        let manifests = match named_by {
            Some(name) => list(name),
            None => {
                let mut folders: Vec<PathBuf> = of_user("XDG_CONFIG_HOME", ".config").into_iter().collect();
                folders.extend(list("XDG_CONFIG_DIRS"));
                folders.extend(["/etc/xdg", "/usr/local/etc", "/etc"].map(PathBuf::from));
                folders.extend(of_user("XDG_DATA_HOME", ".local/share"));
                folders.extend(list("XDG_DATA_DIRS"));
                folders.extend(["/usr/local/share", "/usr/share"].map(PathBuf::from));
                let folders = folders.iter().map(|folder| folder.join("vulkan/icd.d"));
                list("VK_ADD_DRIVER_FILES").into_iter().chain(folders).collect()
            }
        };

        let mut libraries = list("LD_LIBRARY_PATH");
        let triple = format!("{}-linux-gnu", std::env::consts::ARCH);
        libraries.extend(["/usr/lib", "/lib"].map(|folder| Path::new(folder).join(&triple)));
        libraries.extend(["/usr/lib64", "/lib64", "/usr/lib", "/lib", "/usr/local/lib"].map(PathBuf::from));
        Self { manifests, named_by, libraries, linker_cache, has_card: false }
    }

    fn look(&self) -> Found {
        let all: BTreeSet<PathBuf> = self.manifests.iter().flat_map(|place| manifests(place)).collect();
        let (manifests, useless) =
            all.into_iter().partition(|path| is_for_this_machine(path) && (self.has_card || is_software(path)));
        let in_folders = || self.libraries.iter().map(|folder| folder.join(LOADER)).find(|path| path.is_file());
        Found { manifests, useless, loader: loader_in_cache(&self.linker_cache).or_else(in_folders) }
    }
}

/// What a machine has to draw with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Found {
    /// Manifests, each of which stands for a driver.
    manifests: BTreeSet<PathBuf>,
    /// Manifests of drivers for another architecture, or for cards that are not there.
    useless: BTreeSet<PathBuf>,
    /// The library [`LOADER`].
    loader: Option<PathBuf>,
}

impl Found {
    fn is_enough(&self) -> bool {
        !self.manifests.is_empty() && self.loader.is_some()
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = |manifests: &BTreeSet<PathBuf>| {
            let names = manifests.iter().filter_map(|path| path.file_name());
            names.map(|name| name.to_string_lossy()).collect::<Vec<_>>().join(", ")
        };
        if !self.manifests.is_empty() {
            write!(f, "Vulkan driver {}", names(&self.manifests))?;
        } else if self.useless.is_empty() {
            f.write_str("no Vulkan driver (no manifest in a folder such as /usr/share/vulkan/icd.d)")?;
        } else {
            let useless = names(&self.useless);
            write!(f, "no Vulkan driver for this machine ({useless}: for another architecture, or without its card)")?;
        }
        match &self.loader {
            Some(path) => write!(f, ", loader {}", path.display()),
            None => write!(f, ", no loader ({LOADER})"),
        }
    }
}

/// A manifest itself, or those in a folder. What cannot be read is not there for the loader either.
fn manifests(place: &Path) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.to_owned()];
    }
    let Ok(entries) = std::fs::read_dir(place) else { return Vec::new() };
    let files = entries.filter_map(Result::ok).map(|entry| entry.path()).filter(|path| path.is_file());
    files.filter(|path| path.extension().is_some_and(|extension| extension == "json")).collect()
}

/// Whether a manifest is for programs of this architecture: some say so in their names, some in themselves, and what
/// says nothing is.
fn is_for_this_machine(manifest: &Path) -> bool {
    let name = manifest.file_stem().unwrap_or_default().to_string_lossy();
    let named = name.rsplit_once('.').and_then(|(_, word)| architecture(word));
    if named.is_some_and(|named| named != std::env::consts::ARCH) {
        return false;
    }
    let text = std::fs::read_to_string(manifest).unwrap_or_default();
    library_bits(&text).is_none_or(|bits| bits == usize::BITS)
}

/// The architecture, as Rust calls it, that a word of the name of a manifest means.
fn architecture(word: &str) -> Option<&'static str> {
    Some(match word {
        "x86_64" | "amd64" => "x86_64",
        "i386" | "i486" | "i586" | "i686" | "x86" => "x86",
        "aarch64" | "arm64" => "aarch64",
        "arm" | "armhf" | "armv7l" | "armv7hl" => "arm",
        "ppc64" | "ppc64le" | "ppc64el" | "powerpc64" | "powerpc64le" => "powerpc64",
        "riscv64" => "riscv64",
        "s390x" => "s390x",
        "loong64" | "loongarch64" => "loongarch64",
        _ => return None,
    })
}

/// What a manifest says of the width of its library, which it may since version 1.0.1 of the format.
fn library_bits(manifest: &str) -> Option<u32> {
    let (_, rest) = manifest.split_once("\"library_arch\"")?;
    let value = rest.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?;
    value.split('"').next()?.parse().ok()
}

/// Whether a manifest is that of a driver that needs no card.
fn is_software(manifest: &Path) -> bool {
    let name = manifest.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    ["lvp", "lavapipe", "swrast", "swiftshader"].iter().any(|word| name.contains(word))
}

/// Whether there is a graphics card among the devices: Linux's own kind, NVIDIA's, or that of Windows below.
fn has_card(devices: &Path) -> bool {
    let nodes = std::fs::read_dir(devices.join("dri")).into_iter().flatten().filter_map(Result::ok);
    let mut names = nodes.map(|node| node.file_name());
    names.any(|name| name.to_string_lossy().starts_with("renderD"))
        || ["nvidia0", "dxg"].iter().any(|node| devices.join(node).exists())
}

/// The loader among the lines of `ldconfig -p`, which are `NAME (KIND) => PATH`.
fn loader_in_cache(cache: &str) -> Option<PathBuf> {
    let lines = cache.lines().filter_map(|line| line.trim().split_once(" => "));
    let loaders = lines.filter(|(library, _)| {
        // Beside the loader that is needed there may be one for programs of 32 bits.
        let fits = |kind: &str| cfg!(not(target_arch = "x86_64")) || kind.contains("x86-64");
        library.split_once(' ').is_some_and(|(name, kind)| name == LOADER && fits(kind))
    });
    loaders.map(|(_, path)| PathBuf::from(path)).find(|path| path.is_file())
}

/// Nothing where there is no such cache, as with musl.
fn linker_cache() -> String {
    // The second is for users in whose search path there are no tools of the administrator.
    let printed = ["ldconfig", "/sbin/ldconfig"].into_iter().find_map(|program| output(program, &["-p"]));
    printed.unwrap_or_default()
}

/// As whom packages can be installed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rights {
    Root,
    /// By `sudo`, which asks for no password.
    Sudo,
}

/// `None` where there is no `apt-get`, or nobody may use it.
fn rights() -> Option<Rights> {
    output("apt-get", &["--version"])?;
    if output("id", &["-u"]).is_some_and(|id| id.trim() == "0") {
        return Some(Rights::Root);
    }
    output("sudo", &["--non-interactive", "true"]).map(|_| Rights::Sudo)
}

/// What installs [`PACKAGES`], a program with its arguments each.
fn apt_commands(rights: Rights) -> [Vec<&'static str>; 2] {
    let mut apt_get = match rights {
        Rights::Root => Vec::new(),
        Rights::Sudo => vec!["sudo", "--non-interactive"],
    };
    // Nobody is there to answer the questions of a package.
    apt_get.extend(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
    let mut update = apt_get.clone();
    update.push("update");
    let mut install = apt_get;
    install.extend(["install", "--yes", "--no-install-recommends"]);
    install.extend(PACKAGES);
    [update, install]
}

/// Runs a program in view of the user.
fn run(command: &[&str]) -> Result<()> {
    let line = command.join(" ");
    let (program, args) = command.split_first().context("there is no command to run")?;
    println!("== {line}");
    let status = Command::new(program).args(args).stdin(Stdio::null()).status();
    let status = status.with_context(|| format!("running `{line}`"))?;
    ensure!(status.success(), "`{line}` failed; {REMEDY}");
    Ok(())
}

/// What a program prints; `None` when it is not there or fails.
fn output(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).stdin(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path) {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("the folder can be made");
        std::fs::write(path, "{}").expect("the file can be written");
    }

    #[cfg(unix)]
    fn places(variables: &[(&str, &str)]) -> Places {
        let set = |name: &str| variables.iter().find(|(known, _)| *known == name);
        Places::new(|name| set(name).map(|(_, value)| OsString::from(value)), String::new())
    }

    fn complete() -> Found {
        let manifests = BTreeSet::from([PathBuf::from("/share/vulkan/icd.d/lvp_icd.json")]);
        Found { manifests, loader: Some(PathBuf::from("/lib/libvulkan.so.1")), ..Found::default() }
    }

    #[test]
    fn a_driver_is_a_manifest_and_the_loader() {
        let temp = tempfile::tempdir().expect("a folder");
        let (icd, lib) = (temp.path().join("icd.d"), temp.path().join("lib"));
        let places = Places { manifests: vec![icd.clone()], libraries: vec![lib.clone()], ..Places::default() };
        assert_eq!(places.look(), Found::default());

        // Neither a text, nor a folder, nor a library of another name is taken for one.
        write(&icd.join("README"));
        write(&icd.join("folder.json/inner"));
        write(&lib.join("libvulkan.so.1.3.239"));
        assert_eq!(places.look(), Found::default());

        let manifest = icd.join(format!("lvp_icd.{}.json", std::env::consts::ARCH));
        write(&manifest);
        let manifests = BTreeSet::from([manifest.clone()]);
        assert_eq!(places.look(), Found { manifests: manifests.clone(), ..Found::default() });
        assert!(!places.look().is_enough());

        let loader = lib.join(LOADER);
        write(&loader);
        let found = places.look();
        assert_eq!(found, Found { manifests, loader: Some(loader), ..Found::default() });
        assert!(found.is_enough());

        // A manifest may be named itself, and one that is found twice is one.
        let places = Places { manifests: vec![manifest.clone(), icd, temp.path().join("absent.json")], ..places };
        assert_eq!(places.look().manifests, BTreeSet::from([manifest.clone()]));

        std::fs::remove_file(manifest).expect("it was there");
        assert!(places.look().manifests.is_empty() && !places.look().is_enough());
    }

    /// A machine without a card has the drivers of all of them, since they come in one package.
    #[test]
    fn a_driver_needs_its_architecture_and_its_card() {
        let temp = tempfile::tempdir().expect("a folder");
        let (icd, dev) = (temp.path().join("icd.d"), temp.path().join("dev"));
        let places = |has_card| Places { manifests: vec![icd.clone()], has_card, ..Places::default() };
        let names = |manifests: &BTreeSet<PathBuf>| -> Vec<String> {
            let names = manifests.iter().filter_map(|path| path.file_name());
            names.map(|name| name.to_string_lossy().into_owned()).collect()
        };
        let (here, foreign) = match std::env::consts::ARCH {
            "x86" => ("x86", "x86_64"),
            here => (here, "i686"),
        };
        let bits = |bits: u32| format!("{{ \"ICD\": {{ \"library_arch\" : \"{bits}\" }} }}");

        write(&icd.join(format!("radeon_icd.{here}.json")));
        write(&icd.join(format!("lvp_icd.{foreign}.json")));
        write(&icd.join("lvp_narrow.json"));
        std::fs::write(icd.join("lvp_narrow.json"), bits(96 - usize::BITS)).expect("the file can be written");
        let none = places(false).look();
        assert!(none.manifests.is_empty() && none.useless.len() == 3, "{none}");
        assert!(none.to_string().contains("no Vulkan driver for this machine") && !none.is_enough(), "{none}");
        assert_eq!(names(&places(true).look().manifests), [format!("radeon_icd.{here}.json")]);

        // A software driver needs no card, whatever its manifest is called and whether it tells its width.
        write(&icd.join(format!("lvp_icd.{here}.json")));
        write(&icd.join("vk_swiftshader_icd.json"));
        std::fs::write(icd.join("vk_swiftshader_icd.json"), bits(usize::BITS)).expect("the file can be written");
        let found = places(false).look();
        assert_eq!(names(&found.manifests), [format!("lvp_icd.{here}.json"), "vk_swiftshader_icd.json".to_owned()]);
        assert_eq!(places(true).look().manifests.len(), 3);

        // What stands for a card.
        assert!(!has_card(&dev));
        for (node, counts) in [("null", false), ("dri/card0", false), ("dri/renderD128", true)] {
            write(&dev.join(node));
            assert_eq!(has_card(&dev), counts, "{node}");
        }
        for node in ["nvidia0", "dxg"] {
            let dev = temp.path().join(node);
            write(&dev.join(node));
            assert!(has_card(&dev), "{node}");
        }
    }

    #[test]
    fn the_linker_knows_libraries_elsewhere() {
        let temp = tempfile::tempdir().expect("a folder");
        let loader = temp.path().join("libvulkan.so.1.4");
        let line = |name: &str, kind: &str| format!("3 libs found\n\t{name} ({kind}) => {}\n", loader.display());
        let found = |cache: String| Places { linker_cache: cache, ..Places::default() }.look().loader;
        // What is no longer there does not count.
        assert_eq!(found(line(LOADER, "libc6,x86-64")), None);
        write(&loader);
        assert_eq!(found(line(LOADER, "libc6,x86-64")), Some(loader.clone()));
        assert_eq!(found(line(LOADER, "libc6,x86-64, OS ABI: Linux 3.2.0")), Some(loader.clone()));
        assert_eq!(found(line("libvulkan.so.12", "libc6,x86-64")), None);
        assert_eq!(found(line("libvulkan_lvp.so", "libc6,x86-64")), None);
        // On this architecture a library without a kind has 32 bits; others do not tell.
        assert_eq!(found(line(LOADER, "libc6")).is_none(), cfg!(target_arch = "x86_64"));
        for damaged in ["", "=>", " => ", "libvulkan.so.1 => ", "libvulkan.so.1 (libc6,x86-64) =>"] {
            assert_eq!(found(damaged.to_owned()), None, "{damaged:?}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn the_environment_says_where_to_look() {
        let has = |places: &Places, path: &str| places.manifests.iter().any(|place| place == Path::new(path));

        let plain = places(&[]);
        assert_eq!(plain.named_by, None);
        for folder in ["/etc", "/usr/share", "/usr/local/share"] {
            assert!(has(&plain, &format!("{folder}/vulkan/icd.d")), "{plain:?}");
        }
        assert!(plain.libraries.iter().any(|folder| folder == Path::new("/usr/lib64")), "{plain:?}");
        // An empty variable is none: an empty path would be the working folder.
        let empty = places(&[("VK_DRIVER_FILES", ""), ("XDG_DATA_DIRS", ""), ("HOME", ""), ("LD_LIBRARY_PATH", "")]);
        assert_eq!((empty.named_by, &empty.manifests), (None, &plain.manifests));
        assert_eq!(empty.libraries, plain.libraries);

        let user = places(&[("HOME", "/home/ada"), ("XDG_CONFIG_HOME", "/config"), ("XDG_DATA_DIRS", "/a::/b")]);
        for folder in ["/config", "/home/ada/.local/share", "/a", "/b", "/usr/share"] {
            assert!(has(&user, &format!("{folder}/vulkan/icd.d")), "{folder}: {user:?}");
        }
        assert!(!has(&user, "/home/ada/.config/vulkan/icd.d"), "{user:?}");

        let more = places(&[("VK_ADD_DRIVER_FILES", "/more.json"), ("LD_LIBRARY_PATH", "/c:/d")]);
        assert_eq!(more.named_by, None);
        assert!(has(&more, "/more.json") && has(&more, "/usr/share/vulkan/icd.d"), "{more:?}");
        assert_eq!(more.libraries[..2], ["/c", "/d"].map(PathBuf::from));

        // Names replace the folders, and the newer variable the older.
        let old = places(&[("VK_ICD_FILENAMES", "/old.json")]);
        assert_eq!((old.named_by, old.manifests), (Some("VK_ICD_FILENAMES"), vec![PathBuf::from("/old.json")]));
        let both = places(&[("VK_ICD_FILENAMES", "/old.json"), ("VK_DRIVER_FILES", "/new.json:/newer.json")]);
        assert_eq!(both.named_by, Some("VK_DRIVER_FILES"));
        assert_eq!(both.manifests, ["/new.json", "/newer.json"].map(PathBuf::from));
    }

    #[test]
    fn nothing_is_installed_where_there_is_a_driver() {
        let asked = || -> Option<Rights> { panic!("nobody needs to know") };
        assert_eq!(plan(&complete(), None, asked), Plan::Nothing);
        assert_eq!(plan(&complete(), Some("VK_DRIVER_FILES"), asked), Plan::Nothing);
    }

    #[test]
    fn what_is_missing_is_installed_or_told() {
        let no_driver = Found { manifests: BTreeSet::new(), ..complete() };
        let no_loader = Found { loader: None, ..complete() };
        for found in [&no_driver, &no_loader, &Found::default()] {
            for rights in [Rights::Root, Rights::Sudo] {
                assert_eq!(plan(found, None, || Some(rights)), Plan::Install(rights), "{found}");
            }
            let Plan::Fail(why) = plan(found, None, || None) else { panic!("{found}: nobody may install") };
            assert!(why.ends_with(REMEDY), "{why}");
            assert_eq!(why.contains("no Vulkan driver"), found.manifests.is_empty(), "{why}");
            assert_eq!(why.contains("no loader (libvulkan.so.1)"), found.loader.is_none(), "{why}");
        }
        // A variable that leads nowhere is mended by no installation, a missing loader is.
        let Plan::Fail(why) = plan(&no_driver, Some("VK_DRIVER_FILES"), || Some(Rights::Root)) else {
            panic!("the loader would not look at what is installed")
        };
        assert!(why.contains("VK_DRIVER_FILES") && why.contains("unset"), "{why}");
        let named = plan(&no_loader, Some("VK_DRIVER_FILES"), || Some(Rights::Root));
        assert_eq!(named, Plan::Install(Rights::Root));
    }

    #[test]
    fn the_remedy_has_a_line_for_each_family() {
        let lines: Vec<&str> = REMEDY.lines().map(str::trim).collect();
        for (family, packages) in [
            ("Debian, Ubuntu:", PACKAGES),
            ("Fedora:", ["mesa-vulkan-drivers", "vulkan-loader"]),
            ("Arch:", ["vulkan-swrast", "vulkan-icd-loader"]),
        ] {
            let line = lines.iter().find(|line| line.starts_with(family)).expect(family);
            assert!(line.contains("sudo ") && line.ends_with(&packages.join(" ")), "{line}");
        }
    }

    #[test]
    fn apt_is_told_to_ask_nothing() {
        let lines = |rights| apt_commands(rights).map(|command| command.join(" "));
        let as_root = [
            "env DEBIAN_FRONTEND=noninteractive apt-get update",
            "env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends mesa-vulkan-drivers \
             libvulkan1",
        ];
        assert_eq!(lines(Rights::Root), as_root);
        assert_eq!(lines(Rights::Sudo), as_root.map(|line| format!("sudo --non-interactive {line}")));
    }

    #[test]
    fn a_program_that_fails_says_nothing() {
        assert_eq!(output("there is no program of this name", &[]), None);
        assert!(run(&[]).is_err());
        let error = run(&["there is no program of this name"]).expect_err("it cannot be run").to_string();
        assert!(error.contains("there is no program of this name"), "{error}");
    }
}
