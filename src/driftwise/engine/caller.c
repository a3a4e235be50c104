/* Call compiled loops with arrays of NumPy, in a tenth of a microsecond each; and with the numbers of one sample.

Everything of Python's stable interface that is used is declared here and handed over by `caller.py`: no header, no
library, whatever compiler there is. */
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__) || defined(__clang__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

typedef long long I;
typedef struct object {
    I references;
    void *type;
} Object;
typedef struct { /* Py_buffer */
    void *buf;
    Object *obj;
    I len, itemsize;
    int readonly, ndim;
    char *format;
    I *shape, *strides, *suboffsets;
    void *internal;
} Buffer;
typedef struct { /* what an array begins with, for all versions of NumPy */
    Object head;
    char *data;
    int dims;
    I *shape, *strides;
    Object *base, *descr;
    int flags;
} Array;
typedef struct { /* PyMethodDef */
    const char *name;
    void *function;
    int flags;
    const char *about;
} Method;

typedef struct { /* what of Python is used */
    int (*get_buffer)(Object *, Buffer *, int);
    void (*release_buffer)(Buffer *);
    void *(*get_pointer)(Object *, const char *);
    Object *(*new_capsule)(void *, const char *, void *);
    Object *(*new_function)(Method *, Object *, Object *);
    void *(*save_thread)(void);
    void (*restore_thread)(void *);
    I (*as_integer)(Object *);
    double (*as_float)(Object *);
    Object *(*from_integer)(I);
    Object *(*from_float)(double);
    Object *(*new_tuple)(I);
    int (*put)(Object *, I, Object *);
    Object *(*occurred)(void);
    void (*clear_error)(void);
    void (*set_error)(Object *, const char *);
    Object *type_error;
    void *array_type; /* numpy.ndarray; NULL: always ask for buffers */
    Object *floats, *integers; /* its usual types of numbers */
    void *number_types[3];     /* of one number: float, int, numpy.float64 */
    Object *nothing;           /* None */
} Python;

#define READY 0x101 /* an array's flags: C-contiguous, aligned */
#define BUFFER 0x3c /* a buffer's: the same, and it tells what its numbers are */
#define WRITABLE 0x400
#define BUFFER_WRITABLE 0x01
#define MOST 16
#define LONG 4096 /* numbers in arrays from which other threads may run meanwhile */
typedef struct {
    I (*entry)(void *const *, const I *);
    int count;
    int kinds[MOST]; /* dimensions of an array of floats; -1 of integers; -2 an integer, -3 a float */
    int reads[MOST]; /* whether the loop only reads it */
} Loop;

#define WIDEST 16 /* numbers that a sample on its own is shown */
#define ROOM 1024 /* of scratch */
typedef struct {
    Loop *loop;
    int inputs, columns, room; /* inputs: none, or one */
} Stream;

static const char NAME[] = "driftwise loop";
static Python python;

EXPORT void introduce(const Python *given) { python = *given; }

/* Whether a buffer's numbers are the machine's own float64, or int64. */
static int fits(const Buffer *buffer, int is_index)
{
    const char *format = buffer->format;
    if (buffer->itemsize != 8 || !format || !format[0] || format[1])
        return 0;
    return is_index ? format[0] == 'l' || format[0] == 'q' : format[0] == 'd';
}

/* What an array looks like: its memory and sizes; 0 if it is not what the loop takes. */
static int look(Object *given, int kind, int reads, void **data, I *sizes, Buffer *buffer, int *held)
{
    int dims = kind < 0 ? 1 : kind, ready = reads ? READY : READY | WRITABLE, i;
    Array *array = (Array *)given;
    if (python.array_type && given->type == python.array_type && array->dims == dims && (array->flags & ready) == ready
        && array->descr == (kind < 0 ? python.integers : python.floats)) {
        *data = array->data;
        for (i = 0; i < dims; i++)
            sizes[i] = array->shape[i];
        return 1;
    }
    if (python.get_buffer(given, buffer, reads ? BUFFER : BUFFER | BUFFER_WRITABLE))
        return 0;
    *held = 1;
    if (buffer->ndim != dims || !fits(buffer, kind < 0)) {
        python.set_error(python.type_error, "a loop takes C-contiguous arrays of float64 (indices: int64) of its dimensions");
        return 0;
    }
    *data = buffer->buf;
    for (i = 0; i < dims; i++)
        sizes[i] = buffer->shape[i];
    return 1;
}

static Object *call(Object *self, Object *const *args, I count)
{
    Loop *loop = (Loop *)python.get_pointer(self, NAME);
    void *data[MOST], *thread = 0;
    I sizes[4 * MOST], at = 0, total = 0, result;
    double floats[MOST];
    Buffer buffers[MOST];
    int held[MOST], i, j, is_good = 1;
    if (!loop)
        return 0;
    if (count != loop->count) {
        python.set_error(python.type_error, "a loop takes as many arguments as its documentation says");
        return 0;
    }
    for (i = 0; i < count; i++)
        held[i] = 0;
    for (i = 0; i < count && is_good; i++) {
        int kind = loop->kinds[i];
        if (kind == -2) {
            sizes[at] = python.as_integer(args[i]);
            is_good = sizes[at] != -1 || !python.occurred();
            at += 1;
        } else if (kind == -3) {
            floats[i] = python.as_float(args[i]);
            is_good = floats[i] != -1.0 || !python.occurred();
            data[i] = &floats[i];
        } else {
            int dims = kind < 0 ? 1 : kind;
            I size = 1;
            is_good = look(args[i], kind, loop->reads[i], &data[i], sizes + at, &buffers[i], &held[i]);
            for (j = 0; j < dims && is_good; j++)
                size *= sizes[at + j];
            total += is_good ? size : 0;
            at += dims;
        }
    }
    result = 0;
    if (is_good) {
        if (total > LONG)
            thread = python.save_thread();
        result = loop->entry(data, sizes);
        if (total > LONG)
            python.restore_thread(thread);
    }
    for (i = 0; i < count; i++)
        if (held[i])
            python.release_buffer(&buffers[i]);
    return is_good ? python.from_integer(result) : 0;
}

static Method method = {"loop", (void *)call, 0x0080, "loop(*arrays): advance rows in place"};

/* A function of Python that runs the loop. */
EXPORT Object *make(Loop *loop)
{
    return python.new_function(&method, python.new_capsule(loop, NAME, 0), 0);
}

/* A number of Python that is finite, or NaN; 0 if it is anything else. */
static int take(Object *given, double *number)
{
    int i = 0;
    while (i < 3 && given->type != python.number_types[i])
        i += 1;
    if (i == 3)
        return 0;
    *number = python.as_float(given);
    if (*number == -1.0 && python.occurred()) { /* a whole number too large */
        python.clear_error();
        return 0;
    }
    return *number != *number || *number - *number == 0.0;
}

static Object *step(Object *self, Object *const *args, I count)
{
    Stream *stream = (Stream *)python.get_pointer(self, NAME);
    Array *rows, *spec;
    double y, u = 0.0, outs[WIDEST], scratch[ROOM];
    void *data[6];
    I sizes[13], i;
    Object *seen;
    if (!stream)
        return 0;
    if (count != 4)
        return python.new_tuple(0);
    rows = (Array *)args[0], spec = (Array *)args[3];
    if (!python.array_type || rows->head.type != python.array_type || spec->head.type != python.array_type
        || rows->dims != 2 || spec->dims != 1 || rows->descr != python.floats || spec->descr != python.floats
        || (rows->flags & (READY | WRITABLE)) != (READY | WRITABLE) || (spec->flags & READY) != READY || !take(args[1], &y)
        || (stream->inputs ? !take(args[2], &u) : args[2] != python.nothing))
        return python.new_tuple(0);
    data[0] = rows->data, sizes[0] = rows->shape[0], sizes[1] = rows->shape[1];
    data[1] = &y, data[2] = &u, data[3] = outs, data[4] = spec->data, data[5] = scratch;
    for (i = 2; i < 11; i++)
        sizes[i] = 1;
    sizes[7] = stream->inputs;
    sizes[10] = stream->columns;
    sizes[11] = spec->shape[0];
    sizes[12] = stream->room;
    stream->loop->entry(data, sizes);
    seen = python.new_tuple(4);
    for (i = 0; seen && i < 4; i++)
        python.put(seen, i, i < 3 ? python.from_float(outs[i]) : python.from_integer((I)outs[3]));
    return seen;
}

static Method one = {"step", (void *)step, 0x0080, "step(rows, y, u, spec): one sample; () if these are not plain numbers"};

/* A function of Python that advances one row by one sample; for a loop, as `make` returns it, of one output. */
EXPORT Object *make_step(Stream *stream, Object *loop)
{
    stream->loop = (Loop *)python.get_pointer(loop, NAME);
    return stream->loop ? python.new_function(&one, python.new_capsule(stream, NAME, 0), 0) : 0;
}
