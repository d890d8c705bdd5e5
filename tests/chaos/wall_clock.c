/* LD_PRELOAD: shows a process, its native libraries included, a wall clock that tests turn; all other clocks stay.
 *
 * The file named by GHEST_WALL_CLOCK holds three int64: offset in ns, slew in parts per billion, and the CLOCK_MONOTONIC
 * instant in ns from which the slew counts. Deadlines on the wall clock are turned back before the kernel gets them.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define NS 1000000000LL
#define WALL_CLOCK_SINCE_S 1000000000LL /* a deadline beyond this is on the wall clock: no machine runs for 30 years */

static volatile const int64_t *control;
static int (*real_gettime)(clockid_t, struct timespec *);
static int (*real_cond_timedwait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
static int (*real_sem_timedwait)(sem_t *, const struct timespec *);

__attribute__((constructor)) static void begin(void)
{
    real_gettime = dlsym(RTLD_NEXT, "clock_gettime");
    real_cond_timedwait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (!real_cond_timedwait)
        real_cond_timedwait = dlsym(RTLD_NEXT, "pthread_cond_timedwait");
    real_sem_timedwait = dlsym(RTLD_NEXT, "sem_timedwait");
    const char *path = getenv("GHEST_WALL_CLOCK");
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd >= 0) {
        void *memory = mmap(NULL, 3 * sizeof(int64_t), PROT_READ, MAP_SHARED, fd, 0);
        control = memory == MAP_FAILED ? NULL : memory;
        close(fd);
    }
}

static int64_t off_ns(void)
{
    struct timespec now;
    if (!control || real_gettime(CLOCK_MONOTONIC, &now))
        return 0;
    int64_t passed_us = (now.tv_sec * NS + now.tv_nsec - control[2]) / 1000;
    return control[0] + (control[1] ? passed_us * control[1] / 1000000 : 0);
}

static struct timespec moved(struct timespec t, int64_t by_ns)
{
    int64_t ns = t.tv_sec * NS + t.tv_nsec + by_ns;
    t.tv_sec = ns / NS;
    t.tv_nsec = ns % NS;
    return t;
}

int clock_gettime(clockid_t clock, struct timespec *t)
{
    if (!real_gettime)
        begin();
    int result = real_gettime(clock, t);
    if (!result && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *t = moved(*t, off_ns());
    return result;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone)
{
    (void)zone;
    struct timespec now;
    int result = clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec;
    t->tv_usec = now.tv_nsec / 1000;
    return result;
}

time_t time(time_t *t)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (t)
        *t = now.tv_sec;
    return now.tv_sec;
}

static struct timespec for_the_kernel(const struct timespec *deadline)
{
    return deadline->tv_sec > WALL_CLOCK_SINCE_S ? moved(*deadline, -off_ns()) : *deadline;
}

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex, const struct timespec *restrict deadline)
{
    if (!real_cond_timedwait)
        begin();
    struct timespec turned_back = for_the_kernel(deadline);
    return real_cond_timedwait(condition, mutex, &turned_back);
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict deadline)
{
    if (!real_sem_timedwait)
        begin();
    struct timespec turned_back = for_the_kernel(deadline);
    return real_sem_timedwait(semaphore, &turned_back);
}
