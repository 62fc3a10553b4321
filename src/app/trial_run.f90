!> `igaform --check --trial-run`: a quick run with fewer elements shows how much inertia a process
!! has, and so how much mass may be added for a larger step.
module trial_run
  use, intrinsic :: iso_fortran_env, only: int64, error_unit
  use kinds, only: wp
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use failure, only: error_t
  use text, only: string_t, to_text, rounded_text
  use input_errors, only: error_list_t, n_errors
  use scene, only: scene_t, explicit_time
  use coarse_scene, only: coarsen_scene
  use blank, only: blank_t, n_elements_of
  use user_library, only: user_library_t
  use model, only: model_t, increment_limit
  use model_setup, only: build_model
  use step_control, only: next_step
  use run_state, only: run_t
  use run_progress, only: step_fraction
  use forming_run, only: new_run, take_step, has_ended, enter_next_step
  use run_forecast, only: outlook_t, step_cost_t, step_cost
  implicit none
  private

  public :: print_trial_run, inertia_t, advice_lines

  integer, parameter :: coarsening = 3, least_elements = 8
  integer, parameter :: n_samples = 400            !! of the energies
  real(wp), parameter :: most_steps = 20000.0_wp   !! masses rise for no more steps than these
  real(wp), parameter :: early = 0.1_wp            !! fraction of the time in which forming sets in
  real(wp), parameter :: allowed = 0.05_wp         !! kinetic over internal energy of a slow process

  !> What a run shows of its inertia and of its cost.
  type :: inertia_t
    real(wp) :: mean = 0.0_wp      !! kinetic over internal energy, the sums over the run
    real(wp) :: largest = 0.0_wp   !! at any time after the early part
    real(wp) :: internal = 0.0_wp  !! internal energy at the end
    real(wp) :: growth = 1.0_wp    !! steps over those of the first size
    real(wp) :: duration = 1.0_wp  !! time until all relaxations have converged over its limit
    integer :: n_steps = 0
    real(wp) :: seconds = 0.0_wp   !! processor time of all steps [s]
    logical :: is_complete = .false.
  end type inertia_t

contains

  !> Run the scene with fewer elements and print what follows from its energies.
  subroutine print_trial_run(scene, model, outlook, library)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model               !! of the scene as it is
    type(outlook_t), intent(inout) :: outlook        !! as the run shows it, if it can be done
    type(user_library_t), intent(in), optional :: library
    type(scene_t) :: coarse
    type(model_t) :: trial
    type(error_list_t) :: errors
    type(inertia_t) :: inertia
    type(string_t), allocatable :: lines(:)
    integer :: i, n_threads

    coarse = scene
    if (.not. explicit_time(scene%step, scene%later_steps) > 0.0_wp) then
      print "(a)", "trial run        none: no step is explicit"
      return
    end if
    call coarsen_scene(coarse, coarsening, least_elements)
    ! How long a relaxation takes depends on the masses.
    if (.not. any([scene%step%has_relaxation, scene%later_steps%step%has_relaxation])) &
      coarse%step%target_step = max(coarse%step%target_step, scene%step%duration &
                                    /(most_steps*scene%step%safety))
    call build_model(coarse, trial, errors, library)
    if (n_errors(errors) > 0) then
      print "(a)", "trial run        the scene with fewer elements cannot be built"
      return
    end if
    n_threads = omp_get_max_threads()
    call omp_set_num_threads(1)   ! for its processor time to be work
    call run_all(trial, trial%bodies%blank%mass_factor/model%bodies%blank%mass_factor, &
                   inertia)
    call omp_set_num_threads(n_threads)
    if (inertia%is_complete) then
      outlook%growth = growth_of(inertia, trial, model)
      call build_model(coarse, trial, errors, library)   ! as it was before its steps
      call compare_cost(step_cost(trial, real(inertia%n_steps, wp)), &
                        inertia%seconds/inertia%n_steps, outlook)
    end if
    print "(a)", "trial run        "//to_text(n_elements_of(trial%bodies%blank%parts))// &
      " elements, kinetic over internal energy "//percent(inertia%mean)//" in the mean, "// &
      percent(inertia%largest)//" at most after "//to_text(nint(100*early))//" % of the time"
    if (scene%step%is_static .or. any(scene%later_steps%step%is_static)) &
      print "(a)", "                 without the static steps, and what these would have done"
    lines = advice_lines(scene, model, inertia)
    do i = 1, size(lines)
      print "(a)", "advice           "//lines(i)%value
    end do
  end subroutine print_trial_run

  !> What follows from the inertia of a scene: mass scaling that pays, or why none does.
  function advice_lines(scene, model, inertia) result(lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model          !! of the scene as it is
    type(inertia_t), intent(in) :: inertia      !! without what was added for the trial
    type(string_t), allocatable :: lines(:)
    real(wp) :: factor

    allocate (lines(1))
    if (.not. inertia%is_complete) then
      lines(1)%value = "none: the run with fewer elements failed"
      return
    else if (.not. inertia%internal > 0.0_wp) then
      lines(1)%value = "none: nothing deforms"
      return
    end if
    factor = suggested_factor(inertia)
    lines(1)%value = mass_advice(increment_limit(model), factor)
    if (factor < 1.0_wp .or. .not. can_scale_thickness(scene, model)) return
    lines = [lines, lines]
    lines(2)%value = "*MASS SCALING, THICKNESS=4: 0.53 times the cost in the stored study of "// &
      "the slow strip, where the shape error rose from 0.35 to 0.46 mm of a 3 mm sheet, that "// &
      "of the plastic strain from 0.17 to 0.42 % (docs/accuracy.md)"
  end function advice_lines

  !> Factor on all masses that lifts the kinetic energy to what a slow process may have. Speeds are
  !! those of the tools, so it grows with the mass.
  pure real(wp) function suggested_factor(inertia) result(factor)
    type(inertia_t), intent(in) :: inertia

    factor = allowed/max(inertia%mean, tiny(1.0_wp))
  end function suggested_factor

  !> On one factor for all masses: the step grows with its root, the kinetic energy with it.
  function mass_advice(safe_step, factor) result(line)
    real(wp), intent(in) :: safe_step   !! time step that is taken without it [time]
    real(wp), intent(in) :: factor      !! that the energies allow
    character(:), allocatable :: line
    real(wp), parameter :: worth = 1.5_wp, most = 100.0_wp
    real(wp) :: used

    if (factor < 1.0_wp) then
      line = "no mass scaling: inertia governs already; slower tools would be nearer to a "// &
             "forming process"
    else if (factor < worth) then
      line = "no mass scaling of all masses: it would save little"
    else
      used = min(factor, most)
      line = "*MASS SCALING, DT="//rounded_text(safe_step*sqrt(used))//" : "// &
             rounded_text(used)//" times the mass, "//percent(1.0_wp/sqrt(used))// &
             " of the steps, kinetic energy about "//percent(allowed*used/factor)// &
             " of the internal"
    end if
  end function mass_advice

  pure logical function can_scale_thickness(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model

    can_scale_thickness = size(scene%blank%patches) == 1 .and. model%bodies%blank%seams%n_groups &
      == 0 .and. .not. scene%step%thickness_factor > 1.0_wp .and. .not. scene%step%is_element_step
  end function can_scale_thickness

  !> All explicit steps of the deck without output. The energies are those of the first of them.
  subroutine run_all(model, added, inertia)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: added       !! factor on all masses for the trial alone
    type(inertia_t), intent(out) :: inertia
    type(run_t) :: run
    type(error_t), allocatable :: error
    type(string_t), allocatable :: notes(:)
    logical :: is_first
    real(wp) :: rate, dt, time, skipped, first_step, start, finish
    integer(int64) :: last_shown

    call system_clock(last_shown)
    time = explicit_time(model%step, model%later_steps)
    skipped = 0.0_wp
    call new_run(model, run)
    rate = model%rate
    dt = 0.0_wp
    first_step = next_step(run%control, 0.0_wp, rate)
    call cpu_time(start)
    is_first = .true.
    do
      if (model%step%is_static) then
        run%instant%time = run%instant%time + model%step%duration
        skipped = skipped + model%step%duration
      else if (is_first) then
        call run_first(model, added, run, rate, dt, inertia, last_shown, error)
        if (allocated(error)) return
        is_first = .false.
      end if
      do while (.not. has_ended(model, run))
        call take_step(model, run, rate, dt, error)
        if (allocated(error)) return
        call show_progress(model, run, last_shown)
      end do
      if (size(model%later_steps) == 0) exit
      call enter_next_step(model, run, notes, error)
      if (allocated(error)) return
    end do
    call cpu_time(finish)
    inertia%is_complete = .true.
    inertia%growth = run%n_steps*first_step/(run%instant%time - skipped)
    inertia%duration = (run%instant%time - skipped)/time
    inertia%n_steps = int(run%n_steps)
    inertia%seconds = finish - start
  end subroutine run_all

  !> The first step of the deck, with its energies at equal times.
  subroutine run_first(model, added, run, rate, dt, inertia, last_shown, error)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: added       !! factor on all masses for the trial alone
    type(run_t), intent(inout) :: run
    real(wp), intent(inout) :: rate     !! largest |J^-1|^2
    real(wp), intent(inout) :: dt       !! [time]
    type(inertia_t), intent(inout) :: inertia
    integer(int64), intent(inout) :: last_shown
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: nothing = 1.0e-3_wp
    real(wp) :: kinetic, sums(2)
    integer :: taken

    sums = 0.0_wp
    taken = 0
    associate (duration => model%step%duration, began => run%control%start_time)
      do while (.not. has_ended(model, run))
        call take_step(model, run, rate, dt, error)
        if (allocated(error)) return
        call show_progress(model, run, last_shown)
        if (run%instant%time - began < taken*duration/n_samples) cycle
        taken = taken + 1
        kinetic = kinetic_energy(model%bodies%blank)/added
        sums = sums + [kinetic, run%balance%internal]
        ! A blank that moves as a whole has no internal energy to compare with.
        if (run%instant%time - began > early*duration .and. &
            run%balance%internal > nothing*kinetic) inertia%largest = &
          max(inertia%largest, kinetic/run%balance%internal)
      end do
    end associate
    inertia%mean = sums(1)/max(sums(2), tiny(1.0_wp))
    inertia%internal = run%balance%internal
  end subroutine run_first

  !> A line about every five seconds on how far the run is, to standard error: a relaxation by the
  !! decay of its residuals, other steps by their time.
  subroutine show_progress(model, run, last_shown)
    type(model_t), intent(in) :: model
    type(run_t), intent(in) :: run
    integer(int64), intent(inout) :: last_shown   !! clock when that was
    integer, parameter :: every = 5               !! [s]
    integer(int64) :: now, rate
    real(wp) :: fraction
    character(:), allocatable :: done

    if (mod(run%n_steps, 64_int64) /= 0) return
    call system_clock(now, rate)
    if (now - last_shown < every*rate) return
    last_shown = now
    fraction = step_fraction(model, run)
    if (.not. model%step%has_relaxation) then
      done = to_text(nint(100*fraction))//" % of its time"
    else if (fraction >= 0.0_wp) then
      done = to_text(nint(100*fraction))//" % of its relaxation"
    else
      done = "its residuals do not decay yet"
    end if
    write (error_unit, "(a)") "trial run        step "//to_text(model%i_step)//" of "// &
      to_text(model%i_step + size(model%later_steps))//", "//done
  end subroutine show_progress

  !> Steps of another model of the scene over those of the first size in its whole time. What
  !! shortens them are elements bent over radii, the more the longer they are: in a square box of
  !! 8, 12, 16 and 24 elements along its side the growth is 1.48, 1.28, 1.18 and 1.14.
  pure real(wp) function growth_of(inertia, trial, model) result(growth)
    type(inertia_t), intent(in) :: inertia
    type(model_t), intent(in) :: trial, model
    real(wp) :: coarse, fine   ! elements

    coarse = n_elements_of(trial%bodies%blank%parts)
    fine = n_elements_of(model%bodies%blank%parts)
    growth = inertia%duration*(1.0_wp + (inertia%growth - 1.0_wp)*sqrt(coarse/fine))
  end function growth_of

  !> What part of the points flowed, and how the mean step compares with what was foretold for it.
  pure subroutine compare_cost(foretold, mean_step, outlook)
    type(step_cost_t), intent(in) :: foretold
    real(wp), intent(in) :: mean_step   !! processor time [s]
    type(outlook_t), intent(inout) :: outlook
    real(wp), parameter :: no_time = 1.0e-9_wp   ! [s]

    outlook%flowing = min(1.0_wp, max(0.0_wp, mean_step - foretold%elastic) &
                                  /max(foretold%flow, no_time))
    outlook%ratio = mean_step/max(foretold%elastic + outlook%flowing*foretold%flow, no_time)
    outlook%is_tried = .true.
  end subroutine compare_cost

  !> From the velocities of half a step ago, which is near enough here.
  pure real(wp) function kinetic_energy(blank) result(energy)
    type(blank_t), intent(in) :: blank
    integer :: p, c

    energy = 0.0_wp
    do p = 1, size(blank%parts)
      do c = 1, 3
        associate (element => blank%parts(p)%element)
          energy = energy + 0.5_wp*sum(element%mass*element%motion%v(:, :, :, c)**2)
        end associate
      end do
    end do
  end function kinetic_energy

  function percent(fraction) result(text)
    real(wp), intent(in) :: fraction
    character(:), allocatable :: text

    text = rounded_text(100.0_wp*fraction)//" %"
  end function percent

end module trial_run
