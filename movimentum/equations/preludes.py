"""Helper functions that programs in each language need: tables, Newton's linear step, angles with their turns."""

PYTHON = '''\
"""Made by `movimentum equations`. Lengths in pixels, y up; angles in degrees."""
import math
{head}

def root(x):
    return math.sqrt(max(x, 0.0))


def lookup(times, values, tau):
    return values[max(sum(time <= tau for time in times) - 1, 0)]


def between(times, values, tau):
    k = max(sum(time <= tau for time in times) - 1, 0)
    if k + 1 >= len(times):
        return values[k]
    w = min(max((tau - times[k]) / (times[k + 1] - times[k]), 0.0), 1.0)
    return values[k] + w * (values[k + 1] - values[k])


def turned(y, x, near):
    angle = math.degrees(math.atan2(y, x))
    return angle + 360.0 * math.floor((near - angle) / 360.0 + 0.5)


def eliminate(a, b):
    n = len(b)
    for i in range(n):
        p = max(range(i, n), key=lambda r: abs(a[r][i]))
        a[i], a[p], b[i], b[p] = a[p], a[i], b[p], b[i]
        for r in range(i + 1, n):
            f = a[r][i] / a[i][i]
            for c in range(i, n):
                a[r][c] -= f * a[i][c]
            b[r] -= f * b[i]
    for i in reversed(range(n)):
        b[i] = (b[i] - sum(a[i][c] * b[c] for c in range(i + 1, n))) / a[i][i]
    return b

'''

C = """\
/* Made by `movimentum equations`. Lengths in pixels, y up; angles in degrees.
   cc -DMAIN -o pose FILE -lm && ./pose 0 0.5 1    prints a table of the times given. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#ifndef M_PI
#define M_PI 3.14159265358979323846
#endif
#define COUNT {count}

typedef struct {{ {fields} }} constants;
const constants DEFAULTS = {{ {values} }};
const char *const NAMES[COUNT] = {{
    {names}
}};

static inline double root(double x) {{ return x > 0 ? sqrt(x) : 0.0; }}

static inline int place(int n, const double *times, double tau) {{
    int k = 0;
    while (k + 1 < n && times[k + 1] <= tau) k++;
    return k;
}}

static inline double lookup(int n, const double *times, const double *values, double tau) {{
    return values[place(n, times, tau)];
}}

static inline double between(int n, const double *times, const double *values, double tau) {{
    int k = place(n, times, tau);
    if (k + 1 >= n) return values[k];
    double w = fmin(fmax((tau - times[k]) / (times[k + 1] - times[k]), 0.0), 1.0);
    return values[k] + w * (values[k + 1] - values[k]);
}}

static inline double turned(double y, double x, double near) {{
    double angle = atan2(y, x) * 180.0 / M_PI;
    return angle + 360.0 * floor((near - angle) / 360.0 + 0.5);
}}

static inline double eliminate(int n, double *a, double *b) {{
    double size = 0.0;
    for (int i = 0; i < n; i++) {{
        int p = i;
        for (int r = i + 1; r < n; r++) if (fabs(a[r * n + i]) > fabs(a[p * n + i])) p = r;
        for (int c = 0; c < n; c++) {{ double h = a[i * n + c]; a[i * n + c] = a[p * n + c]; a[p * n + c] = h; }}
        {{ double h = b[i]; b[i] = b[p]; b[p] = h; }}
        for (int r = i + 1; r < n; r++) {{
            double f = a[r * n + i] / a[i * n + i];
            for (int c = i; c < n; c++) a[r * n + c] -= f * a[i * n + c];
            b[r] -= f * b[i];
        }}
    }}
    for (int i = n - 1; i >= 0; i--) {{
        for (int c = i + 1; c < n; c++) b[i] -= a[i * n + c] * b[c];
        b[i] /= a[i * n + i];
        size = fmax(size, fabs(b[i]));
    }}
    return size;
}}

void pose(double t, const constants *given_, double *out_) {{
{taken}
{body}
}}

#ifdef MAIN
int main(int argc, char **argv) {{
    double out[COUNT];
    printf("time");
    for (int i = 0; i < COUNT; i++) printf(",%s", NAMES[i]);
    for (int j = 1; j < argc; j++) {{
        pose(atof(argv[j]), &DEFAULTS, out);
        printf("\\n%s", argv[j]);
        for (int i = 0; i < COUNT; i++) printf(",%.17g", out[i]);
    }}
    printf("\\n");
    return 0;
}}
#endif
"""

JAVASCRIPT = """\
// Made by `movimentum equations`. Lengths in pixels, y up; angles in degrees.
function root(x) {{ return Math.sqrt(Math.max(x, 0)); }}

function place(times, tau) {{
  let k = 0;
  while (k + 1 < times.length && times[k + 1] <= tau) k++;
  return k;
}}

function lookup(times, values, tau) {{ return values[place(times, tau)]; }}

function between(times, values, tau) {{
  const k = place(times, tau);
  if (k + 1 >= times.length) return values[k];
  const w = Math.min(Math.max((tau - times[k]) / (times[k + 1] - times[k]), 0), 1);
  return values[k] + w * (values[k + 1] - values[k]);
}}

function turned(y, x, near) {{
  const angle = Math.atan2(y, x) * 180 / Math.PI;
  return angle + 360 * Math.floor((near - angle) / 360 + 0.5);
}}

function eliminate(a, b) {{
  const n = b.length;
  for (let i = 0; i < n; i++) {{
    let p = i;
    for (let r = i + 1; r < n; r++) if (Math.abs(a[r][i]) > Math.abs(a[p][i])) p = r;
    [a[i], a[p]] = [a[p], a[i]];
    [b[i], b[p]] = [b[p], b[i]];
    for (let r = i + 1; r < n; r++) {{
      const f = a[r][i] / a[i][i];
      for (let c = i; c < n; c++) a[r][c] -= f * a[i][c];
      b[r] -= f * b[i];
    }}
  }}
  for (let i = n - 1; i >= 0; i--) {{
    for (let c = i + 1; c < n; c++) b[i] -= a[i][c] * b[c];
    b[i] /= a[i][i];
  }}
  return b;
}}

const NAMES = [
  {names}
];

function pose(t, {{ {constants} }} = {{}}) {{
  let found_;
{body}
  return Object.fromEntries(NAMES.map((name, k) => [name, found_[k]]));
}}

if (typeof module !== "undefined") module.exports = {{ pose, NAMES }};
"""

MATLAB = """\
function [values_, names_] = pose(t, given_)
% Made by `movimentum equations`. Lengths in pixels, y up; angles in degrees.
  names_ = {{{names}}};
{given}
{body}
end

function y = root(x)
  y = sqrt(max(x, 0));
end

function v = lookup(times, values, tau)
  v = values(max(sum(times <= tau), 1));
end

function v = between(times, values, tau)
  k = max(sum(times <= tau), 1);
  v = values(k);
  if k < numel(times)
    w = min(max((tau - times(k)) / (times(k + 1) - times(k)), 0), 1);
    v = v + w * (values(k + 1) - v);
  end
end

function a = turned(y, x, near)
  a = atan2(y, x) * 180 / pi;
  a = a + 360 * floor((near - a) / 360 + 0.5);
end
"""

JULIA = """\
# Made by `movimentum equations`. Lengths in pixels, y up; angles in degrees.
root(x) = sqrt(max(x, 0.0))
place(times, tau) = max(count(times .<= tau), 1)
lookup(times, values, tau) = values[place(times, tau)]

function between(times, values, tau)
    k = place(times, tau)
    k < length(times) || return values[k]
    w = clamp((tau - times[k]) / (times[k + 1] - times[k]), 0.0, 1.0)
    return values[k] + w * (values[k + 1] - values[k])
end

function turned(y, x, near)
    angle = rad2deg(atan(y, x))
    return angle + 360.0 * floor((near - angle) / 360.0 + 0.5)
end

eliminate(rows, right) = permutedims(reduce(hcat, rows)) \\ right

const NAMES = [{names}]

function pose(t{constants})
{body}
    return Dict(zip(NAMES, found_))
end
"""
