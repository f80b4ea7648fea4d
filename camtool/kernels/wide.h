/* Functions compiled for several processors.

   CAMTOOL_WIDE before a function compiles it for three kinds of x86 processors; the loader chooses the
   widest that runs. Sums are split into the same partial sums in all of them and no product is
   fused with a sum, so results are equal to the last bit. Other compilers compile it once. */

#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(CAMTOOL_CHECKED)
#if defined(__clang__) /* and zig's compiler: it does not combine clones with `flatten` */
#define CAMTOOL_WIDE __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define CAMTOOL_WIDE __attribute__((flatten, target_clones("arch=x86-64-v4", "avx2", "default")))
#endif
#else
#define CAMTOOL_WIDE
#endif
