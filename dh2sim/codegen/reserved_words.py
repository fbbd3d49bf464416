"""Words that a constant cannot be named, by language.

Those of the libraries are among them: a constant ``gamma`` beside <math.h> is an error in C, and one named ``map``
would hide the function that a file of Python calls.
"""

from __future__ import annotations

import builtins
import keyword
from typing import Final

_PYTHON_IMPORTS: Final = "np cos sin Iterable ArrayLike NDArray"
PYTHON_NAMES: Final = frozenset([*keyword.kwlist, *keyword.softkwlist, *dir(builtins), *_PYTHON_IMPORTS.split()])

_C_KEYWORDS: Final = """
    auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    alignas alignof bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual asm
    fortran near far huge main linux unix i386 arm mips sun vax NULL EOF
"""

_MATH: Final = """
    acos asin atan atan2 cos sin tan acosh asinh atanh cosh sinh tanh exp exp2 expm1 frexp ilogb ldexp log log10
    log1p log2 logb modf scalbn scalbln cbrt fabs hypot pow sqrt erf erfc lgamma tgamma ceil floor nearbyint
    rint lrint llrint round lround llround trunc fmod remainder remquo copysign nan nextafter nexttoward fdim
    fmax fmin fma fpclassify isfinite isinf isnan isnormal signbit isgreater isgreaterequal isless islessequal
    islessgreater isunordered j0 j1 jn y0 y1 yn gamma signgam drem significand finite scalb exp10 pow10
    roundeven sincos canonicalize setpayload getpayload totalorder llogb nextup nextdown fadd fsub fmul fdiv
    fsqrt ffma dadd dsub dmul ddiv dsqrt dfma fromfp ufromfp fmaxmag fminmag fmaximum fminimum issignaling
    issubnormal iszero iscanonical double_t float_t exception matherr HUGE DOMAIN SING OVERFLOW UNDERFLOW PLOSS
    TLOSS NAN INFINITY HUGE_VAL SNAN MATH_ERRNO MATH_ERREXCEPT math_errhandling FP_NAN FP_INFINITE FP_ZERO
    FP_SUBNORMAL FP_NORMAL FP_ILOGB0 FP_ILOGBNAN FP_FAST_FMA FP_INT_UPWARD M_E M_LOG2E M_LOG10E M_LN2 M_LN10
    M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2 abs div labs min max
"""

C_NAMES: Final = frozenset(word + suffix for word in f"{_C_KEYWORDS} {_MATH}".split() for suffix in ("", "f", "l"))

_CPP_KEYWORDS: Final = """
    and and_eq bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield compl concept
    consteval constinit const_cast decltype delete dynamic_cast explicit export friend import module mutable
    namespace new noexcept not not_eq operator or or_eq private protected public reinterpret_cast requires
    static_cast template this throw try typeid typename using virtual wchar_t xor xor_eq std final override
    size_t ptrdiff_t
"""

CPP_NAMES: Final = C_NAMES | set(_CPP_KEYWORDS.split())

_MATLAB_WORDS: Final = """
    break case catch classdef continue do else elseif end end_try_catch end_unwind_protect endclassdef
    endenumeration endevents endfor endfunction endif endmethods endparfor endproperties endswitch endwhile
    enumeration events for function global if methods otherwise parfor persistent properties return spmd switch
    try until unwind_protect unwind_protect_cleanup while arguments cos sin zeros ans i j pi e eps inf nan Inf
    NaN NA varargin varargout nargin nargout import get set
"""

MATLAB_NAMES: Final = frozenset(_MATLAB_WORDS.split())

_JAVASCRIPT_WORDS: Final = """
    abstract arguments async await boolean break byte case catch char class const continue debugger default
    delete do double else enum eval export extends false final finally float for function goto if implements
    import in instanceof int interface let long native new null of package private protected public return short
    static super switch synchronized this throw throws transient true try typeof undefined var void volatile
    while with yield Math NaN Infinity globalThis Array Object
"""

JAVASCRIPT_NAMES: Final = frozenset(_JAVASCRIPT_WORDS.split())
