//! GLSL to SPIR-V with glslang, behind a cache on disk keyed by the text of every file involved.
//! Enters: a `Source`. Leaves: SPIR-V words, or an error with file and line.

use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::path::PathBuf;

use glslang::error::GlslangError;
use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, GlslProfile, ShaderInput, ShaderMessage, ShaderSource, ShaderStage,
    SourceLanguage, SpirvVersion, Target, VulkanVersion,
};

use super::fault::ShaderFault;
use super::sources::Source;
use crate::error::{RendererError, Result};

/// First word of every SPIR-V module.
const SPIRV_MAGIC: u32 = 0x0723_0203;
/// Bump when the compiler or its options change.
const CACHE_VERSION: u32 = 1;

/// So deep files may include others.
const MOST_INCLUDES: usize = 64;
/// So many includes are read for one main file, each as often as it is named: files that include each other twice would never end.
const MOST_READ: usize = 4096;
/// The compiler goes as deep as expressions do: a long sum needs more than threads have. Memory is taken where it is used.
const STACK_BYTES: usize = 1 << 30;

/// Compiled shaders on disk. Losing it costs time only.
#[derive(Clone, Debug, Default)]
pub struct SpirvCache {
    folder: Option<PathBuf>,
}

impl SpirvCache {
    /// The user's cache folder, `$XDG_CACHE_HOME/caustica/spirv` or `~/.cache/caustica/spirv`; none without a home.
    pub fn of_user() -> Self {
        let base = std::env::var_os("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")));
        Self { folder: base.map(|base| base.join("caustica").join("spirv")) }
    }

    /// A cache in `folder`.
    pub fn at(folder: PathBuf) -> Self {
        Self { folder: Some(folder) }
    }

    fn path(&self, key: u64) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.join(format!("{key:016x}.spv")))
    }

    fn load(&self, key: u64) -> Option<Vec<u32>> {
        let bytes = std::fs::read(self.path(key)?).ok()?;
        let words: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
            .collect();
        let (checksum, words) = words.split_last()?;
        (words.first() == Some(&SPIRV_MAGIC) && *checksum == checksum_of(words)).then(|| words.to_vec())
    }

    fn store(&self, key: u64, words: &[u32]) {
        let Some(path) = self.path(key) else { return };
        let bytes: Vec<u8> =
            words.iter().chain([&checksum_of(words)]).flat_map(|word| word.to_le_bytes()).collect();
        // Written under another name first: two processes may compile the same shader at once.
        let temporary = path.with_extension(format!("{}.tmp", std::process::id()));
        let written = path
            .parent()
            .map_or(Ok(()), std::fs::create_dir_all)
            .and_then(|()| std::fs::write(&temporary, bytes))
            .and_then(|()| std::fs::rename(&temporary, &path));
        if let Err(error) = written {
            tracing::debug!("the shader cache was not written: {}: {error}", path.display());
        }
    }
}

fn checksum_of(words: &[u32]) -> u32 {
    words.iter().fold(0x811c_9dc5, |hash, word| (hash ^ word).wrapping_mul(0x0100_0193))
}

fn key_of(source: &Source) -> u64 {
    let mut hasher = std::hash::DefaultHasher::new();
    (CACHE_VERSION, env!("CARGO_PKG_VERSION"), &source.file, &source.texts).hash(&mut hasher);
    hasher.finish()
}

/// Compiles a main file, or takes the result of an earlier run from the cache.
///
/// # Errors
/// [`RendererError::Compile`] with the compiler's messages.
pub fn compile(source: &Source, cache: &SpirvCache) -> Result<Vec<u32>> {
    let key = key_of(source);
    if let Some(words) = cache.load(key) {
        return Ok(words);
    }
    let words = compile_now(source)?;
    cache.store(key, &words);
    Ok(words)
}

/// Serves includes from the texts that were read before.
struct Includes<'a> {
    source: &'a Source,
    /// What was asked for and is not there, with the reason.
    refused: BTreeMap<String, String>,
    read: usize,
}

impl IncludeHandler for Includes<'_> {
    fn include(&mut self, _: IncludeType, header: &str, _: &str, depth: usize) -> Option<IncludeResult> {
        let text = self.source.texts.get(header).map(|text| unmarked(text));
        // Files that include each other would fill the memory.
        self.read += 1;
        let is_endless = depth > MOST_INCLUDES || self.read > MOST_READ;
        let reason = match self.source.missing.get(header) {
            _ if depth > MOST_INCLUDES => format!("more than {MOST_INCLUDES} files include each other"),
            _ if is_endless => format!("more than {MOST_READ} includes, as files include each other"),
            Some(reason) => reason.clone(),
            None => "files are included as \"PATH\", from the folder of the shaders".to_owned(),
        };
        match text.filter(|_| !is_endless) {
            Some(data) => Some(IncludeResult { name: header.to_owned(), data }),
            None => {
                self.refused.insert(header.to_owned(), reason);
                None
            }
        }
    }
}

fn compile_now(source: &Source) -> Result<Vec<u32>> {
    let mut includes = Includes { source, refused: BTreeMap::new(), read: 0 };
    let words = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name(source.file.clone()).stack_size(STACK_BYTES);
        let words = thread.spawn_scoped(scope, || words_of(source, &mut includes));
        let words = words.map_err(|error| format!("there is no memory to compile it: {error}"))?;
        words.join().unwrap_or_else(|_| Err(String::from("the compiler gave up")))
    });
    words.map_err(|log| RendererError::Compile {
        file: source.file.clone(),
        faults: ShaderFault::of_log(&log, source, &includes.refused),
    })
}

/// SPIR-V, or what the compiler says.
fn words_of(source: &Source, includes: &mut Includes<'_>) -> std::result::Result<Vec<u32>, String> {
    let compiler = Compiler::acquire().ok_or("glslang did not start")?;
    let stage = stage_of(&source.file).ok_or("unknown stage: see the file's ending")?;
    let text = source.texts.get(&source.file).map(|text| unmarked(text)).unwrap_or_default();
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_3, spirv_version: SpirvVersion::SPIRV1_6 },
        version_profile: Some((460, GlslProfile::None)),
        messages: ShaderMessage::DEFAULT
            | ShaderMessage::CASCADING_ERRORS
            | ShaderMessage::DISPLAY_ERROR_COLUMN,
    };
    let glsl = ShaderSource::from(text);
    let input = ShaderInput::new(&glsl, stage, &options, None::<&[(&str, Option<&str>)]>, Some(includes))
        .map_err(|error| log_of(&error))?;
    let shader = compiler.create_shader(input).map_err(|error| log_of(&error))?;
    shader.compile().map_err(|error| log_of(&error))
}

/// Without a byte order mark, which the compiler takes for a statement.
fn unmarked(text: &str) -> String {
    text.strip_prefix('\u{feff}').unwrap_or(text).to_owned()
}

fn stage_of(file: &str) -> Option<ShaderStage> {
    Some(match file.rsplit('.').next()? {
        "vert" => ShaderStage::Vertex,
        "frag" => ShaderStage::Fragment,
        "comp" => ShaderStage::Compute,
        "rgen" => ShaderStage::RayGeneration,
        "rchit" => ShaderStage::ClosestHit,
        "rahit" => ShaderStage::AnyHit,
        "rmiss" => ShaderStage::Miss,
        "rint" => ShaderStage::Intersect,
        _ => return None,
    })
}

/// What glslang says.
fn log_of(error: &GlslangError) -> String {
    match error {
        GlslangError::PreprocessError(log)
        | GlslangError::ParseError(log)
        | GlslangError::MapIoError(log)
        | GlslangError::LinkError(log) => log.log.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    fn source(text: &str) -> Source {
        let texts =
            [("test.comp", text), ("lib/a.glsl", "float a() { return 1.0; }\nfloat b() { return oops; }\n")];
        let texts = texts.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
        Source { file: String::from("test.comp"), texts, ..Source::default() }
    }

    #[test]
    fn errors_name_file_and_line() {
        let error =
            compile_now(&source("#version 460\nvoid main() {\n  int x = y;\n}\n")).unwrap_err().to_string();
        assert!(error.contains("test.comp:3:"), "{error}");
        let text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"lib/a.glsl\"\nvoid main() {}\n";
        let error = compile_now(&source(text)).unwrap_err().to_string();
        assert!(error.contains("lib/a.glsl:2:"), "{error}");
    }

    #[test]
    fn files_that_include_each_other_end_in_an_error_and_marks_in_none() {
        let head = "#version 460\n#extension GL_GOOGLE_include_directive : require\n";
        assert!(compile_now(&source(&format!("\u{feff}{head}void main() {{}}\n"))).is_ok());
        let text = format!("{head}#include \"test.comp\"\nvoid main() {{}}\n");
        let error = compile_now(&source(&text)).unwrap_err().to_string();
        assert!(error.contains("test.comp:"), "{error}");
    }

    #[test]
    fn an_include_that_is_not_there_is_an_error_where_the_compiler_comes_to_it() {
        let head = "#version 460\n#extension GL_GOOGLE_include_directive : require\n";
        let compiled = |text: &str| {
            let mut source = source(&format!("{head}{text}\nvoid main() {{}}\n"));
            source.missing.insert("lib/none.glsl".to_owned(), "there is no such file".to_owned());
            compile_now(&source).map_err(|error| error.to_string())
        };
        assert!(compiled("#if 0\n#include \"lib/none.glsl\"\n#endif").is_ok());
        let error = compiled("\n#include \"lib/none.glsl\"\nfloat of_it = NONE;").unwrap_err();
        assert!(!error.contains("NONE"), "it may be in the file that is not there: {error}");
        let words =
            "test.comp:4:1: include \"lib/none.glsl\": there is no such file\n    #include \"lib/none.glsl\"";
        assert!(error.contains(words), "{error}");
        let error = compiled("#include <lib/other.glsl>").unwrap_err();
        assert!(
            error.contains("test.comp:3:1: include \"lib/other.glsl\": files are included as"),
            "{error}"
        );
    }

    #[test]
    fn the_cache_gives_back_what_was_compiled_and_ignores_damage() {
        let folder = std::env::temp_dir().join(format!("caustica-spirv-{}", std::process::id()));
        let cache = SpirvCache::at(folder.clone());
        let good = source("#version 460\nlayout(local_size_x = 1) in;\nvoid main() {}\n");
        let words = compile(&good, &cache).unwrap();
        assert_eq!(cache.load(key_of(&good)), Some(words.clone()));
        let path = cache.path(key_of(&good)).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[20] ^= 0xff;
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(cache.load(key_of(&good)), None);
        assert_eq!(compile(&good, &cache).unwrap(), words);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
